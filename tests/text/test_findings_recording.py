"""Each mistake in recording.yaml is named in words, at its place, with a cure; the words are pinned here."""

from pathlib import Path

import pytest
from example_recording import FLANGE, POSES, RECORDING, SHOTS, changed, findings_of, write_example

from sixthlink.files import read_recording

LEFT_POSE = "      pose: {T_camera_head: [[1, 0, 0, -200], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}\n"
TARGET = "target: {kind: chessboard, columns: 12, rows: 9, square: 20}"
UNIT_ROWS = "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 150], [0, 0, 0, 1]]"
ROTATION_CURE = "copy all four rows with at least five digits; the translation is the last column"

MISTAKES = {
    "unit of angle missing": (
        [("{length: mm, angle: deg}", "{length: mm}")],
        'recording.yaml:3:1: units.angle: is missing; write it, for example "angle: deg"',
    ),
    "no units": (
        [("units: {length: mm, angle: deg}\n", "")],
        'recording.yaml:1:1: units: is missing; write it, for example "units: {length: mm, angle: deg}"',
    ),
    "unit in capitals": (
        [("length: mm", "length: MM")],
        "recording.yaml:3:17: units.length: is the text 'MM', expected m, cm, mm, um or in; did you mean mm or m?",
    ),
    "text where a number belongs": (
        [("square: 20", "square: twenty")],
        "recording.yaml:17:58: target.square: is the text 'twenty', expected a number; "
        'write for example "square: 20"',
    ),
    "boolean where a number belongs": (
        [("square: 20", "square: true")],
        'recording.yaml:17:58: target.square: is true, expected a number; write for example "square: 20"',
    ),
    "number that is none": (
        [("square: 20", "square: .nan")],
        'recording.yaml:17:58: target.square: is nan, expected a finite number; write for example "square: 20"',
    ),
    "infinite number": (
        [("focal_px: [900, 900]", "focal_px: [900, 1e999]")],
        "recording.yaml:14:36: head.cameras.left.intrinsics.focal_px[1]: is inf, expected a finite number; "
        'write for example "focal_px: [4900, 4900]"',
    ),
    "negative length": (
        [("square: 20", "square: -20")],
        'recording.yaml:17:58: target.square: is -20, expected more than 0; write for example "square: 20"',
    ),
    "count that is not whole": (
        [("columns: 12", "columns: 12.5")],
        'recording.yaml:17:37: target.columns: is 12.5, expected a whole number; write for example "columns: 9"',
    ),
    "number where a name belongs": (
        [("name: example", "name: 012")],
        "recording.yaml:2:7: name: is 12, expected a text; put it in quotes",
    ),
    "too few distortion numbers": (
        [("distortion: [0, 0, 0, 0, 0]", "distortion: [0, 0, 0, 0]")],
        "recording.yaml:14:77: head.cameras.left.intrinsics.distortion: has 4 terms for a pinhole lens, expected "
        '5, 8 or 12: k1, k2, p1, p2, k3, ...; write "model: fisheye" for a fisheye, or 0 for missing terms',
    ),
    "a number of distortion terms that nobody uses": (
        [("distortion: [0, 0, 0, 0, 0]", "distortion: [0, 0, 0]")],
        "recording.yaml:14:77: head.cameras.left.intrinsics.distortion: is a list of 3, expected a list of 5, 8 or 12, "
        "or of 4 with model: fisheye; write one of these",
    ),
    "a fisheye with terms of a pinhole": (
        [("{focal_px: [900, 900]", "{model: fisheye, focal_px: [900, 900]")],
        "recording.yaml:14:93: head.cameras.left.intrinsics.distortion: has 5 terms for a fisheye lens, expected "
        "k1, k2, k3, k4; leave p1 and p2 out",
    ),
    "unknown robot": (
        [("abb_irb1400", "abb_irb140")],
        "recording.yaml:6:9: robot.name: 'abb_irb140' is not known, expected one of ... did you mean abb_irb1400?",
    ),
    "robot not named": (
        [("  name: abb_irb1400\n", "")],
        "recording.yaml:5:1: robot: does not say which robot it is, expected exactly one of name, arm, urdf, "
        'kinematics; write for example "name: abb_irb1400"',
    ),
    "robot named twice": (
        [("name: abb_irb1400", "name: abb_irb1400\n  arm: a.yaml")],
        "recording.yaml:5:1: robot: has name and arm, expected exactly one of name, arm, urdf, kinematics; "
        "keep one of them",
    ),
    "arm file outside": (
        [("name: abb_irb1400", "arm: ../my.yaml")],
        "recording.yaml:6:8: robot.arm: '../my.yaml' leaves the folder of the recording, expected "
        "a file in the "
        "folder of the recording; copy the file into the folder and correct the path",
    ),
    "positions missing": (
        [("  positions: joints\n", "")],
        'recording.yaml:5:1: robot.positions: is missing; write it, for example "positions: joints"',
    ),
    "orientation beside joints": (
        [("positions: joints", "positions: joints\n  orientation: abb")],
        "recording.yaml:8:3: robot.orientation: is only for positions: flange-poses, "
        "expected no such key beside positions: joints; remove it",
    ),
    "nominal of the other mount": (
        [("mount: eye-in-hand", "mount: eye-to-hand")],
        "recording.yaml:16:13: head.nominal.T_flange_head: does not fit mount: eye-to-hand, "
        "expected T_base_head; write the other one, or remove nominal",
    ),
    "sheared matrix": (
        [(UNIT_ROWS, UNIT_ROWS.replace("[1, 0, 0, 0]", "[1, 0.1, 0, 0]"))],
        "recording.yaml:16:28: head.nominal.T_flange_head: the matrix is not a rotation: its columns miss "
        "orthonormality by 0.1, at most 0.001 is rounding, expected a rotation and a translation; " + ROTATION_CURE,
    ),
    "mirrored matrix": (
        [(UNIT_ROWS, UNIT_ROWS.replace("[1, 0, 0, 0]", "[-1, 0, 0, 0]"))],
        "recording.yaml:16:28: head.nominal.T_flange_head: the matrix is mirrored (determinant -1): "
        "a left-handed frame or swapped columns, expected a rotation and a translation; " + ROTATION_CURE,
    ),
    "matrix with a row missing": (
        [(UNIT_ROWS, "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 150]]")],
        "recording.yaml:16:28: head.nominal.T_flange_head: is a list of 3, expected a list of 4; "
        f'write for example "T_flange_head: {UNIT_ROWS}"',
    ),
    "reference that is no camera": (
        [("reference: right", "reference: rigth")],
        "recording.yaml:9:14: head.reference: 'rigth' is no camera, expected one of right, left; did you mean right?",
    ),
    "pose of the reference": (
        [("intrinsics: calibrate", "intrinsics: calibrate, pose: calibrate")],
        "recording.yaml:11:63: head.cameras.right.pose: is given for the reference camera, "
        "expected no pose: its frame is the head's; remove it",
    ),
    "pose missing": (
        [(LEFT_POSE, "")],
        "recording.yaml:12:5: head.cameras.left.pose: is missing, expected calibrate or T_camera_head "
        'for every camera but the reference; write for example "pose: calibrate"',
    ),
    "intrinsics misspelled": (
        [("intrinsics: calibrate", "intrinsics: calibrated")],
        "recording.yaml:11:52: head.cameras.right.intrinsics: is the text 'calibrated', "
        "expected calibrate or a mapping; did you mean calibrate?",
    ),
    "unknown kind of target": (
        [("kind: chessboard", "kind: chesboard")],
        "recording.yaml:17:16: target.kind: is the text 'chesboard', expected one of ... did you mean chessboard or "
        "marker-chessboard?",
    ),
    "no target": (
        [(TARGET, "target: none")],
        "recording.yaml:17:9: target: is missing, expected a target for observations: images; "
        f'write for example "{TARGET}"',
    ),
    "marks with one name": (
        [("[A, B]", "[A, A]")],
        "recording.yaml:18:98: length_standard.marks: are the same, expected two different names; rename one",
    ),
    "unit of joints exchanged": (
        [("angle: deg", "angle: rad")],
        "recording.yaml:3:28: units.angle: is rad, but a joint is at 90, more than two turns: "
        "that looks like degrees, expected the unit of q1, q2 ... in shots.csv; "
        "correct units.angle; or, if it is right, write robot.positions_confirmed: true",
    ),
    "schema of another edition": (
        [("recording/1", "recording/2")],
        "recording.yaml:1:9: schema: is the text 'sixthlink-recording/2', expected sixthlink-recording/1; "
        "did you mean sixthlink-recording/1?",
    ),
}


@pytest.mark.parametrize("changes, message", [pytest.param(*m, id=k) for k, m in MISTAKES.items()])
def test_mistake_is_the_only_finding_and_reads_well(
    tmp_path: Path, changes: list[tuple[str, str]], message: str
) -> None:
    findings = findings_of(write_example(tmp_path, changed(RECORDING, *changes)))
    beginning, _, end = message.partition(" ... ")
    assert len(findings) == 1, findings
    if end.startswith("did"):  # the list of everything known grows with the package
        assert findings[0].startswith(beginning) and findings[0].endswith(end)
    else:
        assert findings[0] == message


def test_example_itself_is_right(tmp_path: Path) -> None:
    recording = read_recording(write_example(tmp_path))
    assert recording.ids == ("s1", "s2", "s3", "s4", "r1")
    assert recording.images["left"] == ("b.png", "b.png", "", "b.png", "b.png")
    assert recording.marks == ("", "", "", "", "A")


def test_unknown_keys_come_with_the_nearest_and_with_all(tmp_path: Path) -> None:
    spoiled = changed(
        RECORDING, ("mount: eye", "mout: eye"), ("image_size_px: [640, 480], i", "image_size: [640, 480], i")
    )
    assert findings_of(write_example(tmp_path, spoiled)) == [
        'recording.yaml:1:1: mount: is missing; write it, for example "mount: eye-in-hand"',
        "recording.yaml:4:1: mout: is not a section of a recording, expected schema, name, units, "
        "mount, robot, "
        "head, target, length_standard, observations, target_poses; did you mean mount?",
        "recording.yaml:11:5: head.cameras.right.image_size_px: is missing; "
        'write it, for example "image_size_px: [2452, 2056]"',
        "recording.yaml:11:13: head.cameras.right.image_size: is not a key of this file, "
        "expected image_size_px, intrinsics or pose; did you mean image_size_px?",
    ]


def test_conventions_of_flange_poses_are_never_guessed(tmp_path: Path) -> None:
    spoiled = changed(RECORDING, ("positions: joints", "positions: flange-poses"))
    assert findings_of(write_example(tmp_path, spoiled, POSES)) == [
        "recording.yaml:5:1: robot.orientation: is missing, expected the maker's way of writing an "
        "orientation; "
        'write for example "orientation: abb"',
        "recording.yaml:5:1: robot.direction: is missing, expected T_base_flange (flange in the base) or "
        'T_flange_base; write for example "direction: T_base_flange"',
    ]


def test_makers_dialect_misspelled(tmp_path: Path) -> None:
    spoiled = changed(RECORDING, ("positions: joints", FLANGE.replace("quaternion-xyzw", "kukka")))
    (finding,) = findings_of(write_example(tmp_path, spoiled, POSES))
    assert finding.startswith("recording.yaml:8:16: robot.orientation: is the text 'kukka', expected quaternion-wxyz")
    assert finding.endswith("did you mean kuka?")


def test_robot_without_kinematics_needs_label_and_flange_poses(tmp_path: Path) -> None:
    spoiled = changed(RECORDING, ("name: abb_irb1400", "kinematics: none"))
    assert findings_of(write_example(tmp_path, spoiled)) == [
        "recording.yaml:5:1: robot.label: is missing, expected a name for people, because "
        "kinematics is none; "
        'write for example "label: Denso VS-6577"',
        "recording.yaml:7:14: robot.positions: is joints, but kinematics is none, expected flange-poses; "
        "give the robot's name or an arm file, or record flange poses",
    ]


def test_one_run_names_the_mistakes_of_all_files(tmp_path: Path) -> None:
    spoiled = changed(RECORDING, ("length: mm", "length: furlong"), ("kind: chess", "kind: dots-"), ("1234.15", "no"))
    shots = changed(SHOTS, ("s4,p2,calibrate", "s4,p2,x"), ("a.png,,", "c.png,,"))
    places = [f.split(" ")[0] for f in findings_of(write_example(tmp_path, spoiled, shots))]
    assert places == [
        "recording.yaml:3:17:",
        "recording.yaml:17:16:",
        "recording.yaml:18:27:",
        "shots.csv:4:11:",
        "shots.csv:5:3:",
    ]


def test_small_degrees_must_be_confirmed(tmp_path: Path) -> None:
    rows = "".join(f"s{i},p,calibrate,{i},1,-2,3,4,5,a.png,b.png\n" for i in range(5))
    shots = "shot,placement,kind,q1,q2,q3,q4,q5,q6,image_right,image_left\n" + rows
    (finding,) = findings_of(write_example(tmp_path / "doubted", RECORDING, shots))
    assert finding == (
        "recording.yaml:3:28: units.angle: is deg, but no joint of any shot is beyond 5: that "
        "looks like radians, "
        "expected the unit of q1, q2 ... in shots.csv; "
        "correct units.angle; or, if it is right, write robot.positions_confirmed: true"
    )
    confirmed = changed(RECORDING, ("positions: joints", "positions: joints\n  positions_confirmed: true"))
    assert read_recording(write_example(tmp_path / "confirmed", confirmed, shots)).joints is not None
    four = write_example(tmp_path / "four", RECORDING, shots.rsplit("s4", 1)[0])
    assert len(read_recording(four).ids) == 4


def test_target_poses_need_their_convention_and_no_cameras(tmp_path: Path) -> None:
    spoiled = changed(RECORDING, ("observations: images", "observations: target-poses"))
    assert findings_of(write_example(tmp_path, spoiled)) == [
        "recording.yaml:1:1: target_poses: is missing, expected how the measured poses are written; "
        'write for example "target_poses: {orientation: quaternion-xyzw, direction: T_head_target}"',
        "recording.yaml:10:3: head.cameras: has cameras, "
        "expected cameras: none for observations: target-poses; remove the cameras",
    ]
    unasked = RECORDING + "target_poses: {orientation: abb, direction: T_head_target}\n"
    assert findings_of(write_example(tmp_path, unasked)) == [
        "recording.yaml:20:1: target_poses: is not for observations: images; remove it"
    ]


def test_every_key_of_the_schema_has_an_example_that_is_right() -> None:
    from pydantic import BaseModel

    from sixthlink.files import recording_schema
    from sixthlink.files.yaml_marks import yaml_from_text

    keys = {name.rsplit(".", 1)[-1] for name in recording_schema.EXAMPLES}
    models = [m for m in vars(recording_schema).values() if isinstance(m, type) and issubclass(m, BaseModel)]
    assert {name for m in models for name in m.model_fields} <= keys
    for name, line in recording_schema.EXAMPLES.items():
        (key,) = yaml_from_text(line, name).value
        assert key == name.rsplit(".", 1)[-1] or name.endswith("*")
