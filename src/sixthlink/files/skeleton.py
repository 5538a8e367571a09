"""What does a user start from?

A folder in which every key of the format is explained where it stands, and which is complete except for the
images.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from sixthlink.errors import Finding, InputError
from sixthlink.files.atomic import atomic_write_text

__all__ = ["write_new_files", "write_skeleton"]

_RECORDING = """\
# A sixthlink recording. Change what is not so in your cell; nothing here has a hidden default.
# 'sixthlink calibrate' in this folder names everything that is missing or contradictory.

schema: sixthlink-recording/1          # edition of this format
name: my cell                          # for people

# Units of this file and of shots.csv. Pixels are pixels.
units:
  length: mm                           # m, cm, mm, um or in
  angle: deg                           # rad, mrad or deg

mount: eye-in-hand                     # or eye-to-hand: fixed camera, target on the flange

robot:
  # Which robot: exactly one of these four.
  name: abb_irb1400                    # a robot that sixthlink knows
  # arm: my_arm.yaml                   # an arm file in this folder
  # urdf: {file: my_robot.urdf, base: base_link, tip: tool0}
  # kinematics: none                   # nothing known: flange poses only, and a label for people
  # label: Denso VS-6577

  positions: joints                    # columns q1, q2 ...; or flange-poses: columns x, y, z and orientation
  # Only with flange-poses, and mandatory there:
  # orientation: abb                   # or kuka, fanuc, ur, quaternion-xyzw ... (docs/formats.md)
  # direction: T_base_flange           # the flange seen from the base; or T_flange_base
  # positions_confirmed: true          # only when sixthlink doubts the unit of the joints and you are sure

head:
  reference: right                     # the camera whose frame is the frame of the head
  cameras:
    right:
      image_size_px: [2452, 2056]      # width, height
      intrinsics: calibrate            # from the images of this recording; or, as known:
      # intrinsics:
      #   focal_px: [4900, 4900]       # fx, fy
      #   centre_px: [1225.5, 1027.5]  # cx, cy; the centre of the first pixel is (0, 0)
      #   distortion: [0, 0, 0, 0, 0]  # k1, k2, p1, p2, k3
    # A second camera on the same head:
    # left:
    #   image_size_px: [2452, 2056]
    #   intrinsics: calibrate
    #   pose: calibrate                # or {T_camera_head: four rows of four numbers}
  # Pose of the head in the drawing, to compare with (eye-to-hand: T_base_head):
  # nominal:
  #   T_flange_head: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 150], [0, 0, 0, 1]]

target:
  kind: chessboard
  columns: 12                          # inner corners along x
  rows: 9                              # inner corners along y
  square: 20                           # side of a square, as measured on the board

# A bar of certified length, to fix the scale (shots of kind scale) and to judge the result (kind verify).
length_standard: none
# length_standard:
#   length: 1234.15                    # certified distance of the two marks
#   uncertainty: 0.003                 # standard uncertainty (k = 1) of that length
#   mark: quadrant                     # a disc of alternating black and white quarters
#   mark_diameter: 24
#   marks: [A, B]                      # names of the two ends

observations: images                   # or pixels (in pixels.csv), or target-poses (in shots.csv)
# Or touches: a ball on the flange rests in a socket in every shot, which the column mark names. Then leave out mount,
# head and target; length_standard, if any, has mark: socket, no mark_diameter, and as marks two of the sockets.
# Only with target-poses, and mandatory there:
# target_poses: {orientation: quaternion-xyzw, direction: T_head_target}
"""

_SHOTS = """\
shot,placement,kind,mark,q1,q2,q3,q4,q5,q6,image_right,note
p1_01,p1,calibrate,,0,10.5,-20,0,45,0,images/p1_01_right.png,an example; replace it
p1_02,p1,calibrate,,5,12,-18.25,20,40,90,images/p1_02_right.png,same placement: the target has not moved
"""


def write_skeleton(folder: Path) -> list[Path]:
    """Write a commented ``recording.yaml`` and a ``shots.csv`` with two example rows.

    Args:
        folder: The folder; it is created when missing.

    Returns:
        The files that were written.

    Raises:
        InputError: One of the files exists already; nothing is written.
        OSError: The folder cannot be written.
    """
    return write_new_files({folder / "recording.yaml": _RECORDING, folder / "shots.csv": _SHOTS})


def write_new_files(texts: Mapping[Path, str]) -> list[Path]:
    """Write several files that must not exist yet, or none of them.

    Raises:
        InputError: One of the files exists already; nothing is written.
        OSError: A folder cannot be written.
    """
    cure = "choose another folder, or remove the file"
    taken = [Finding(str(path), "file", "exists already", "a new folder", cure) for path in texts if path.exists()]
    if taken:
        raise InputError(taken)
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic_write_text(path, text)
    return list(texts)
