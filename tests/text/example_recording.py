"""A small correct recording, to be spoiled in one place per test."""

from pathlib import Path

import pytest

from sixthlink.errors import InputError
from sixthlink.files import read_recording

RECORDING = """\
schema: sixthlink-recording/1
name: example
units: {length: mm, angle: deg}
mount: eye-in-hand
robot:
  name: abb_irb1400
  positions: joints
head:
  reference: right
  cameras:
    right: {image_size_px: [640, 480], intrinsics: calibrate}
    left:
      image_size_px: [640, 480]
      intrinsics: {focal_px: [900, 900], centre_px: [320, 240], distortion: [0, 0, 0, 0, 0]}
      pose: {T_camera_head: [[1, 0, 0, -200], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
  nominal: {T_flange_head: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 150], [0, 0, 0, 1]]}
target: {kind: chessboard, columns: 12, rows: 9, square: 20}
length_standard: {length: 1234.15, uncertainty: 0.003, mark: quadrant, mark_diameter: 24, marks: [A, B]}
observations: images
"""

SHOTS = """\
shot,placement,kind,mark,q1,q2,q3,q4,q5,q6,image_right,image_left,note
s1,p1,calibrate,,0,10,-20,30,40,50,a.png,b.png,
s2,p1,calibrate,,5,12,-18,20,45,90,a.png,b.png,"tilted, a little"
s3,p1,calibrate,,-5,8,-22,10,50,10,a.png,,
s4,p2,calibrate,,-9,6,-25,0,55,-60,a.png,b.png,
r1,bar,verify,A,3,4,-20,30,40,50,a.png,b.png,
"""

POSES = """\
shot,placement,kind,x,y,z,qx,qy,qz,qw,image_right,image_left
s1,p1,calibrate,1,2,3,0,0,0,1,a.png,b.png
s2,p1,calibrate,4,5,6,0.6,0,0,0.8,a.png,b.png
s3,p1,calibrate,7,8,9,0,0.6,0,0.8,a.png,b.png
"""

FLANGE = "positions: flange-poses\n  orientation: quaternion-xyzw\n  direction: T_base_flange"


def write_example(folder: Path, recording: str = RECORDING, shots: str = SHOTS, **others: str) -> Path:
    """A folder with the texts, two empty files in place of images, and ``name_suffix=text`` files."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recording.yaml").write_text(recording, encoding="utf-8")
    (folder / "shots.csv").write_text(shots, encoding="utf-8")
    for name in ("a.png", "b.png"):
        (folder / name).write_bytes(b"")
    for name, text in others.items():
        (folder / name.replace("_", ".")).write_text(text, encoding="utf-8")
    return folder


def changed(text: str, *changes: tuple[str, str]) -> str:
    """The text with pieces exchanged, each of which must be there."""
    for old, new in changes:
        if old not in text:
            raise LookupError(f"{old!r} is not in the example")
        text = text.replace(old, new)
    return text


def findings_of(folder: Path) -> list[str]:
    """What is wrong with a recording, with file names relative to its folder."""
    with pytest.raises(InputError) as caught:
        read_recording(folder)
    return [str(f).replace(f"{folder}/", "") for f in caught.value.findings]
