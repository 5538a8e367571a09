"""Each mistake in shots.csv and pixels.csv is named in words, at its row and cell, with a cure."""

from pathlib import Path

import pytest
from example_recording import FLANGE, POSES, RECORDING, SHOTS, changed, findings_of, write_example

from sixthlink.files import read_recording

NUMBER = "expected a finite number; write it with a decimal point and without unit"
IMAGE = (
    "expected an image in the folder of the recording; copy the image there, correct the name, or leave the cell empty"
)
ALL_COLUMNS = "shot, placement, kind, mark, q1, q2, q3, q4, q5, q6, image_right, image_left"

MISTAKES = {
    "joint outside its limit": (
        [("0,10,-20,30", "171,10,-20,30")],
        ["2:5: q1: is 171 in shot s1, expected -170 to 170, the limits of ABB IRB 1400; "
         "check unit, sign and order of the joints; other limits belong in an arm file"],
    ),
    "column misnamed": (
        [(",q6,", ",q7,")],
        [f"1: q6: the column is missing, expected the columns {ALL_COLUMNS} (ABB IRB 1400 has 6 "
         f"joints); add it",
         f"1:10: q7: the column is not known here, expected {ALL_COLUMNS}; "
         "remove it, or call it x-q7 if it is for people only"],
    ),
    "column of images missing": (
        [(",image_left,", ",image_lft,")],
        [f"1: image_left: the column is missing, expected the columns {ALL_COLUMNS} (ABB IRB 1400 "
         f"has 6 joints); "
         "add it",
         f"1:12: image_lft: the column is not known here, expected {ALL_COLUMNS}; did you mean image_left?"],
    ),
    "column twice": (
        [(",q6,", ",q5,")],
        ["1:10: q5: the column is there twice, expected once; remove one of them"],
    ),
    "name used twice": (
        [("s2,p1", "s1,p1")],
        ["3:1: shot: 's1' is the name of the shot in line 2 too, expected each name once; rename "
         "one of them"],
    ),
    "cells left empty": (
        [("s2,p1,", ",,")],
        ["3:1: shot: is empty, expected a name; name the shot",
         "3:2: placement: is empty, expected a name; give shots of a target that did not move the same name"],
    ),
    "unknown kind": (
        [("s4,p2,calibrate", "s4,p2,Calibration")],
        ["5:3: kind: is 'Calibration', expected one of calibrate, judge, scale, verify; did you mean calibrate?"],
    ),
    "too few shots": (
        [("s3,p1,calibrate,", "s3,bar,verify,A"), ("s4,p2,calibrate,", "s4,bar,verify,B")],
        ["kind: there are 2 calibrate shots, expected at least 3, better 10 or more; record more poses"],
    ),
    "marks": (
        [("verify,A", "verify,C"), ("s4,p2,calibrate,", "s4,p2,calibrate,A")],
        ["5:4: mark: is 'A' in a calibrate shot, expected an empty cell; empty the cell, or write "
         "kind scale or verify",
         "6:4: mark: is 'C', expected one of A, B; write which mark of the length standard the shot shows"],
    ),
    "decimal comma": (
        [("s3,p1,calibrate,,-5,8", "s3,p1,calibrate,,-5,5,8")],
        ["4: row: has 14 cells, expected 13, one per column; write 1.5, not 1,5; put a text that "
         "has a comma in quotes"],
    ),
    "numbers that are none": (
        [("-18", "nan"), ("-22", "1_0"), ("-25", ""), ("3,4,-20", "1e999,4,-20")],
        [f"3:7: q3: is 'nan', {NUMBER}", f"4:7: q3: is '1_0', {NUMBER}", f"5:7: q3: is empty, {NUMBER}",
         f"6:5: q1: is '1e999', {NUMBER}"],
    ),
    "images missing, outside and none": (
        [("40,50,a.png,b.png,\ns2", "40,50,../a.png,/etc/passwd,\ns2"), ("50,10,a.png", "50,10,c.png"),
         ("-60,a.png,b.png", "-60,,")],
        [f"2:11: image_right: '../a.png' leaves the folder of the recording, {IMAGE}",
         f"2:12: image_left: '/etc/passwd' is an absolute path, {IMAGE}",
         f"4:11: image_right: 'c.png' does not exist, {IMAGE}",
         "5:11: image_right: the shot has no image, expected an image of at least one camera; "
         "name the image, or remove the shot"],
    ),
    "another country's CSV": (
        [(",", ";")],
        ["1: header: separates its columns by semicolons, expected commas; "
         "export it as comma separated, with decimal points"],
    ),
    "quote left open": (
        [('little"', "little")],
        ["6: row: is not CSV: unexpected end of data; look for a quote that is not closed"],
    ),
    "empty": ([(SHOTS, "")], ["1: header: is missing, expected names of the columns in line 1; add it"]),
}  # fmt: skip


@pytest.mark.parametrize("changes, messages", [pytest.param(*m, id=k) for k, m in MISTAKES.items()])
def test_mistakes_in_shots(tmp_path: Path, changes: list[tuple[str, str]], messages: list[str]) -> None:
    found = findings_of(write_example(tmp_path, RECORDING, changed(SHOTS, *changes)))
    assert found == [f"shots.csv:{' ' if m.startswith('kind: there') else ''}{m}" for m in messages]


def test_shots_missing(tmp_path: Path) -> None:
    folder = write_example(tmp_path)
    (folder / "shots.csv").unlink()
    assert findings_of(folder) == [
        "shots.csv: file: does not exist, expected a table with one row per shot or point; add it"
    ]


def test_length_standard_must_be_described(tmp_path: Path) -> None:
    start, end = RECORDING.index("length_standard"), RECORDING.index("observations")
    found = findings_of(write_example(tmp_path, RECORDING[:start] + RECORDING[end:]))
    assert found == [
        "shots.csv:6:3: kind: is verify, but recording.yaml has no length_standard, "
        "expected a length standard; describe it there"
    ]


def test_link_out_of_the_folder(tmp_path: Path) -> None:
    folder = write_example(tmp_path / "recording")
    (tmp_path / "secret.png").write_bytes(b"")
    (folder / "b.png").unlink()
    (folder / "b.png").symlink_to(tmp_path / "secret.png")
    assert set(findings_of(folder)) == {
        f"shots.csv:{line}:12: image_left: 'b.png' leaves the folder of the recording, {IMAGE}" for line in (2, 3, 5, 6)
    }
    (folder / "b.png").unlink()
    (folder / "b.png").symlink_to("a.png")
    assert read_recording(folder).images["left"][0] == "b.png"


@pytest.mark.parametrize("name", ["C:\\images\\a.png", "\\\\server\\a.png", "/a.png", "x" * 5000])
def test_names_that_no_recording_may_use(tmp_path: Path, name: str) -> None:
    found = findings_of(write_example(tmp_path, RECORDING, changed(SHOTS, ("10,a.png", f"10,{name}"))))
    assert len(found) == 1 and found[0].startswith("shots.csv:4:11: image_right: ")


def test_quaternion_of_wrong_length(tmp_path: Path) -> None:
    recording = changed(RECORDING, ("positions: joints", FLANGE))
    shots = changed(POSES, ("0.6,0,0,0.8", "0.6,0,0,0.7"))
    assert findings_of(write_example(tmp_path, recording, shots)) == [
        "shots.csv:3:7: qx: the quaternion has length 0.921954, expected length 1; "
        "check the order of the columns and the orientation that recording.yaml declares"
    ]


def test_sheared_and_mirrored_matrices(tmp_path: Path) -> None:
    recording = changed(RECORDING, ("positions: joints", FLANGE.replace("quaternion-xyzw", "matrix")))
    fields = ",".join(f"r{i}{j}" for i in "123" for j in "123")
    rows = ["1,0,0,0,1,0,0,0,1", "1,0.1,0,0,1,0,0,0,1", "1,0,0,0,1,0,0,0,-1"]
    shots = f"shot,placement,kind,x,y,z,{fields},image_right,image_left\n" + "".join(
        f"s{i},p1,calibrate,1,2,3,{row},a.png,b.png\n" for i, row in enumerate(rows)
    )
    sheared, mirrored = findings_of(write_example(tmp_path, recording, shots))
    assert sheared.startswith("shots.csv:3:7: r11: matrix is not a rotation: its columns miss orthonormality by 0.1")
    assert mirrored.startswith("shots.csv:4:7: r11: matrix is mirrored (determinant -1)")


def test_spreadsheet_habits_are_accepted(tmp_path: Path) -> None:
    shots = "\ufeff" + SHOTS.replace("\n", "\r\n").replace("s3,p1", " s3 , p1") + ",,,,,,,,,,,,\r\n\r\n"
    recording = read_recording(write_example(tmp_path, RECORDING, shots))
    assert recording.ids == ("s1", "s2", "s3", "s4", "r1") and recording.placements[2] == "p1"


def test_rows_keep_their_line_when_a_cell_spans_two(tmp_path: Path) -> None:
    shots = changed(SHOTS, ("tilted, a little", "tilted,\na little"), ("s4,p2,calibrate", "s4,p2,x"))
    (finding,) = findings_of(write_example(tmp_path, RECORDING, shots))
    assert finding.startswith("shots.csv:6:3: kind: is 'x'")


PIXELS = "shot,camera,point,u_px,v_px\ns1,right,0,1,2\ns1,right,107,3.5,4\nr1,left,A,5,6\n"
BAD_PIXELS = {
    "s1,right,108,1,2": "3: point: is '108', expected a whole number from 0 to 107; "
    "number the points as docs/formats.md shows",
    "s1,right,-1,1,2": "3: point: is '-1', expected a whole number from 0 to 107; "
    "number the points as docs/formats.md shows",
    "s9,right,0,1,2": "1: shot: 's9' is not known, expected one of s1, s2, s3, s4, r1; correct or add it",
    "s1,middle,0,1,2": "2: camera: 'middle' is not known, expected one of right, left; correct or add it",
    "r1,right,B,5,6": "3: point: is 'B', expected A, the mark of the shot; number the points as docs/formats.md shows",
    "s1,right,0,9,9": "3: point: is there already, in line 2, expected each point once per image; remove one of them",
    "s2,left,1,inf,2": f"4: u_px: is 'inf', {NUMBER}",
}


def pixel_shots() -> str:
    return "".join(",".join(line.split(",")[:10]) + "\n" for line in SHOTS.splitlines())


@pytest.mark.parametrize("row, message", BAD_PIXELS.items())
def test_mistakes_in_pixels(tmp_path: Path, row: str, message: str) -> None:
    recording = changed(RECORDING, ("observations: images", "observations: pixels"))
    folder = write_example(tmp_path, recording, pixel_shots(), pixels_csv=f"{PIXELS}{row}\n")
    assert findings_of(folder) == [f"pixels.csv:5:{message}"]


def test_pixels_without_and_with_their_own_sigma(tmp_path: Path) -> None:
    recording = changed(RECORDING, ("observations: images", "observations: pixels"))
    folder = write_example(tmp_path, recording, pixel_shots(), pixels_csv=PIXELS)
    pixels = read_recording(folder).pixels
    assert pixels is not None
    assert pixels.points.tolist() == [0, 107, 0] and pixels.cameras.tolist() == [0, 0, 1]
    assert pixels.shots.tolist() == [0, 0, 4] and pixels.sigmas_px.tolist() == [0.1] * 3
    with_sigma = "shot,camera,point,u_px,v_px,sigma_px\ns1,right,0,1,2,0\n"
    assert findings_of(write_example(tmp_path, recording, pixel_shots(), pixels_csv=with_sigma)) == [
        "pixels.csv:2:6: sigma_px: is 0, expected above 0; write the standard deviation"
    ]
    (folder / "pixels.csv").unlink()
    assert findings_of(folder) == [
        "pixels.csv: file: does not exist, expected a table with one row per shot or point; add it"
    ]
