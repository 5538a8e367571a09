"""A recording that is written reads back the same, whatever its units, conventions and observations."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sixthlink.camera import Camera
from sixthlink.errors import InputError
from sixthlink.files import load_arm, read_recording, write_arm, write_recording, write_skeleton
from sixthlink.files.yaml_marks import yaml_from_text, yaml_text
from sixthlink.geometry import exp_rotation, inverse, transform
from sixthlink.recording import CameraDescription, Detections, Head, Recording
from sixthlink.robot import Arm
from sixthlink.target import Charuco, Chessboard, LengthStandard

N = 7
RELATIVE = 1e-12
NAMED = {"name": "abb_irb1400"}
UNNAMED = {"kinematics": "none", "label": "cell: no. 5"}
Identity = Mapping[str, object]


def poses(rng: np.random.Generator, count: int = N) -> np.ndarray:
    return transform(exp_rotation(rng.normal(size=(count, 3))), rng.normal(size=(count, 3)))


def cameras(rng: np.random.Generator) -> tuple[CameraDescription, ...]:
    lens = Camera(2452, 2056, rng.normal(4900, 9, 2), rng.normal(1000, 9, 2), rng.normal(0, 0.1, 5))
    fisheye = Camera(640, 480, rng.normal(300, 9, 2), rng.normal(300, 9, 2), rng.normal(0, 0.1, 4), "fisheye")
    return (
        CameraDescription("right", 2452, 2056),
        CameraDescription("left", 2452, 2056, lens),
        CameraDescription("top", 640, 480, fisheye, poses(rng, 1)[0]),
    )


def shots(rng: np.random.Generator) -> Recording:
    """Shots with joints, images of three cameras, and a length standard."""
    arm = load_arm("abb_irb1400", folder=Path())
    low, high = arm.limits.T
    kinds = ("calibrate",) * (N - 2) + ("scale", "verify")
    return Recording(
        name='quoted "name": no',
        mount="eye-in-hand",
        robot=arm.name,
        arm=arm,
        head=Head(cameras(rng), poses(rng, 1)[0]),
        target=Chessboard(12, 9, 0.0201234567890123),
        standard=LengthStandard(1.2341500000000001, 3.1e-6, "quadrant", 0.024, ("left, end", "B")),
        ids=tuple(f"s {i}" for i in range(N)),
        placements=("1e3", "012", "no", *("p",) * (N - 3)),
        kinds=kinds,
        marks=("",) * (N - 2) + ("left, end", "B"),
        joints=low + (high - low) * rng.random((N, 6)),
        images={
            "right": tuple(f"images/{i}.png" for i in range(N)),
            "left": ("",) * (N - 1) + ("b ü.png",),
            "top": ("",) * N,
        },
    )


def with_pixels(rng: np.random.Generator) -> Recording:
    M = 40
    one_per_row = np.unravel_index(rng.permutation(N * 3 * 4)[:M], (N, 3, 4))
    shot, camera, point = (np.asarray(i) for i in one_per_row)
    standard_shot = shot >= N - 2
    point = np.where(standard_shot, shot - (N - 2), point)
    keep = np.unique(np.stack([shot, camera, point]), axis=1, return_index=True)[1]
    pixels = Detections(
        shot[keep], camera[keep], point[keep], rng.normal(900, 300, (M, 2))[keep], rng.random(M)[keep] + 0.01
    )
    return replace(shots(rng), images={}, pixels=pixels)


def with_flange_poses(rng: np.random.Generator) -> Recording:
    return replace(
        shots(rng),
        mount="eye-to-hand",
        robot="cell: no. 5",
        arm=None,
        joints=None,
        Ts_base_flange=poses(rng),
        target=Charuco(5, 7, 0.036195, 0.018256, "DICT_6X6_250"),
    )


def with_target_poses(rng: np.random.Generator) -> Recording:
    return replace(
        shots(rng),
        head=Head(()),
        target=None,
        standard=None,
        kinds=("calibrate",) * N,
        marks=("",) * N,
        images={},
        Ts_head_target=poses(rng),
    )


def with_small_joints(rng: np.random.Generator) -> Recording:
    return replace(with_target_poses(rng), joints=rng.normal(0, 0.01, (N, 6)))


VARIANTS = {
    "joints and images": (shots, NAMED),
    "joints and pixels": (with_pixels, NAMED),
    "flange poses, fixed camera": (with_flange_poses, UNNAMED),
    "target poses": (with_target_poses, NAMED),
    "joints that could pass for radians": (with_small_joints, NAMED),
}


@pytest.mark.parametrize("make, robot", [pytest.param(*v, id=k) for k, v in VARIANTS.items()])
@pytest.mark.parametrize("seed", range(3))
def test_written_recording_reads_back(tmp_path: Path, make, robot: Identity, seed: int) -> None:
    recording = make(np.random.default_rng(seed))
    write_recording(tmp_path, recording, robot=robot)
    for name in {n for names in recording.images.values() for n in names if n}:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert_same(read_recording(tmp_path), recording)


def assert_same(read: Recording, written: Recording) -> None:
    for name in ("name", "mount", "robot", "ids", "placements", "kinds", "marks"):
        assert getattr(read, name) == getattr(written, name), name
    assert dict(read.images.items()) == dict(written.images)
    for name in ("joints", "Ts_base_flange", "Ts_head_target"):
        same(getattr(read, name), getattr(written, name))
    same(read.head.nominal, written.head.nominal)
    for c, d in zip(read.head.cameras, written.head.cameras, strict=True):
        assert (c.name, c.width_px, c.height_px) == (d.name, d.width_px, d.height_px)
        same(c.T_camera_head, d.T_camera_head)
        assert (c.camera is None) == (d.camera is None)
        if c.camera and d.camera:
            assert c.camera.model == d.camera.model
            for part in ("focal_px", "centre_px", "distortion"):
                np.testing.assert_array_equal(getattr(c.camera, part), getattr(d.camera, part))
    for c, d in ((read.target, written.target), (read.standard, written.standard)):
        assert type(c) is type(d)
        for part, value in vars(d).items() if d is not None else ():
            assert vars(c)[part] == (pytest.approx(value, rel=RELATIVE) if isinstance(value, float) else value)
    assert (read.pixels is None) == (written.pixels is None)
    if read.pixels and written.pixels:
        for part, value in vars(written.pixels).items():
            np.testing.assert_array_equal(vars(read.pixels)[part], value)


def same(read: np.ndarray | None, written: np.ndarray | None) -> None:
    assert (read is None) == (written is None)
    if read is not None and written is not None:
        np.testing.assert_allclose(read, written, rtol=RELATIVE, atol=4e-16)


def test_existing_recording_is_kept_unless_told(tmp_path: Path) -> None:
    recording = with_target_poses(np.random.default_rng(5))
    write_recording(tmp_path, recording, robot=NAMED)
    before = (tmp_path / "recording.yaml").read_bytes()
    with pytest.raises(InputError, match=r"recording\.yaml: file: exists already"):
        write_recording(tmp_path, replace(recording, name="other"), robot=NAMED)
    assert (tmp_path / "recording.yaml").read_bytes() == before
    write_recording(tmp_path, replace(recording, name="other"), robot=NAMED, overwrite=True)
    assert read_recording(tmp_path).name == "other"


HEADER = """\
schema: sixthlink-recording/1
name: same
units: {{length: {length}, angle: {angle}}}
mount: eye-in-hand
robot:
  {{kinematics: none, label: any, positions: flange-poses, orientation: {orientation}, direction: {direction}}}
head: {{cameras: none}}
observations: target-poses
target_poses: {{orientation: rotation-vector, direction: {target_direction}}}
"""


def in_words(folder: Path, Ts: np.ndarray, targets: np.ndarray, length: str, angle: str, inverted: bool) -> Recording:
    """The same poses written in other units and directions, by hand: KUKA's A, B, C and rotation vectors."""
    metres, radians = (
        {"m": 1.0, "mm": 1e-3, "in": 0.0254}[length],
        {"rad": 1.0, "deg": math.pi / 180, "mrad": 1e-3}[angle],
    )
    if inverted:
        Ts, targets = np.linalg.inv(Ts), np.linalg.inv(targets)
    rows = ["shot,placement,kind,x,y,z,a,b,c,target_x,target_y,target_z,target_rx,target_ry,target_rz"]
    for i, (T, U) in enumerate(zip(Ts, targets, strict=True)):
        R = T[:3, :3]
        abc = np.array([math.atan2(R[1, 0], R[0, 0]), math.asin(-R[2, 0]), math.atan2(R[2, 1], R[2, 2])])
        turn = math.acos((np.trace(U[:3, :3]) - 1) / 2)
        axis = np.array([U[2, 1] - U[1, 2], U[0, 2] - U[2, 0], U[1, 0] - U[0, 1]]) / (2 * math.sin(turn))
        cells = [*(T[:3, 3] / metres), *(abc / radians), *(U[:3, 3] / metres), *(axis * turn / radians)]
        rows.append(f"s{i},p,calibrate," + ",".join(repr(float(c)) for c in cells))
    direction = ("T_flange_base", "T_target_head") if inverted else ("T_base_flange", "T_head_target")
    text = HEADER.format(
        length=length, angle=angle, orientation="kuka", direction=direction[0], target_direction=direction[1]
    )
    folder.mkdir()
    (folder / "recording.yaml").write_text(text)
    (folder / "shots.csv").write_text("\n".join(rows))
    return read_recording(folder)


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("length, angle", [("mm", "deg"), ("m", "rad"), ("in", "mrad")])
def test_units_and_directions_do_not_change_what_was_recorded(
    tmp_path: Path, length: str, angle: str, inverted: bool
) -> None:
    rng = np.random.default_rng(8)
    Ts, targets = poses(rng), poses(rng)
    read = in_words(tmp_path / "r", Ts, targets, length, angle, inverted)
    assert read.Ts_base_flange is not None and read.Ts_head_target is not None
    np.testing.assert_allclose(read.Ts_base_flange, Ts, atol=1e-12)
    np.testing.assert_allclose(read.Ts_head_target, targets, atol=1e-12)
    np.testing.assert_allclose(inverse(read.Ts_base_flange) @ Ts, np.tile(np.eye(4), (N, 1, 1)), atol=1e-12)


def test_sliding_joints_are_lengths(tmp_path: Path) -> None:
    arm = Arm(
        "gantry", "this test", "steps", ("tx", "ty", "rz"), ("x", "y", "turn"), np.zeros(3), np.eye(3),
        ("x", "y", "turn"), np.array([[-1, 1], [-1, 1], [-3, 3]]),
    )  # fmt: skip
    write_arm(tmp_path / "gantry.yaml", arm)
    joints = np.array([[0.5, -0.25, 1.0], [0.1, 0.2, -2.0], [0, 0, 0]])
    recording = replace(
        with_target_poses(np.random.default_rng(2)),
        robot="gantry", arm=arm, joints=joints, ids=("a", "b", "c"), placements=("p",) * 3,
        kinds=("calibrate",) * 3, marks=("",) * 3, Ts_head_target=poses(np.random.default_rng(3), 3),
    )  # fmt: skip
    write_recording(tmp_path, recording, robot={"arm": "gantry.yaml"})
    first = (tmp_path / "shots.csv").read_text().splitlines()[1].split(",")
    assert [float(c) for c in first[4:7]] == pytest.approx([500.0, -250.0, math.degrees(1.0)])
    read = read_recording(tmp_path)
    same(read.joints, joints)
    assert set(read.inputs) == {"recording.yaml", "shots.csv", "gantry.yaml"}


def test_inputs_are_the_hashes_of_the_files(tmp_path: Path) -> None:
    recording = shots(np.random.default_rng(4))
    write_recording(tmp_path, recording, robot=NAMED)
    (tmp_path / "images").mkdir()
    names = {n for names in recording.images.values() for n in names if n}
    for name in names:
        (tmp_path / name).write_bytes(name.encode())
    inputs = read_recording(tmp_path).inputs
    assert set(inputs) == {"recording.yaml", "shots.csv", *names}
    for name, digest in inputs.items():
        assert digest == hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()


def test_arm_given_beside_the_recording_replaces_its_own(tmp_path: Path) -> None:
    recording = with_target_poses(np.random.default_rng(6))
    write_recording(tmp_path / "r", recording, robot=NAMED)
    assert recording.arm is not None
    better = replace(recording.arm, name="better", values=recording.arm.values + 1e-4)
    write_arm(tmp_path / "better.yaml", better)
    read = read_recording(tmp_path / "r", arm=tmp_path / "better.yaml")
    assert read.arm is not None and read.robot == "better" and "better.yaml" in read.inputs
    np.testing.assert_array_equal(read.arm.values, better.values)
    with pytest.raises(InputError, match="does not exist"):
        read_recording(tmp_path / "r", arm=tmp_path / "none.yaml")


def test_skeleton_lacks_nothing_but_images_and_more_shots(tmp_path: Path) -> None:
    written = write_skeleton(tmp_path / "new")
    assert [p.name for p in written] == ["recording.yaml", "shots.csv"]
    with pytest.raises(InputError) as caught:
        read_recording(tmp_path / "new")
    assert [(f.field, f.what) for f in caught.value.findings] == [
        ("kind", "there are 2 calibrate shots"),
        ("image_right", "'images/p1_01_right.png' does not exist"),
        ("image_right", "'images/p1_02_right.png' does not exist"),
    ]
    with pytest.raises(InputError, match="exists already"):
        write_skeleton(tmp_path / "new")


SCALARS = st.none() | st.booleans() | st.integers(-(10**20), 10**20) | st.floats(allow_nan=False) | st.text(max_size=20)
KEYS = st.text(max_size=8)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=8,
)


@settings(deadline=None)
@example({"\x85": "\u2028"})
@given(VALUES)
def test_yaml_that_is_written_reads_back(value: object) -> None:
    assert yaml_from_text(yaml_text({"top": value}), "x").value == {"top": value}
