"""What does somebody with a laser tracker start from?

A folder in which every key is explained where it stands, with a table that shows how points are written; it reads as
it is.
"""

from __future__ import annotations

from pathlib import Path

from sixthlink.files.skeleton import write_new_files

__all__ = ["write_tracker_skeleton"]

_TRACKER = """\
# A sixthlink tracker record. Change what is not so in your cell; nothing here has a hidden default.
# Leave the tables as the instrument exported them, and say here what their columns are.

schema: sixthlink-tracker/1            # edition of this format
name: my cell                          # for people
instrument: Leica AT960                # for people

# Units of this file and of every table that does not name its own.
units:
  length: mm                           # m, cm, mm, um or in
  angle: deg                           # rad, mrad or deg

robot:
  # Which robot: exactly one of these four.
  name: abb_irb1400                    # a robot that sixthlink knows
  # arm: my_arm.yaml                   # an arm file in this folder
  # urdf: {file: my_robot.urdf, base: base_link, tip: tool0}
  # kinematics: none                   # nothing known; then a label for people, and what each joint does
  # label: two-axis positioner
  # joints: [turning, turning]         # or sliding
  # joints_confirmed: true             # only when sixthlink doubts the unit of the joints and you are sure

# Standard deviation (k = 1) of each coordinate: a number; {range: 0.01, angle: 0.0003} of an instrument that stands at
# the origin of its points; columns, when the tables have them; or unknown.
sigma: 0.02
# rotation_sigma: 0.01                 # of a measured orientation

# Where each reflector sits: the number of the link that joint of the same number moves (6 is the flange of an arm of
# six joints), or ground for one that stands still and shows whether the tracker drifts.
reflectors: {R1: 6, R2: 2, N1: ground}

# The joint that moved in each sweep, from 1; or free for points at many joint positions.
sweeps: {A1: 1, A2: 2, cloud: free}

# Tables, in the order in which they were measured. The same file may stand here twice, for two reflectors per row.
tables:
  - file: points.csv
    separator: comma                   # comma, semicolon, tab or space; may be left out when it is plain
    decimal: point                     # point or comma; may be left out when it is plain
    # encoding: cp1252                 # when it is neither UTF-8 nor marked as UTF-16
    # header: 3                        # line of the header, when it is not the first; or none
    # units: {length: in, angle: deg}  # when this table has others
    columns:                           # names of the columns, or their numbers from 1
      x: X
      y: Y
      z: Z
      point: Name
      reflector: Reflector
      joints: [J1, J2, J3, J4, J5, J6] # ~ for a joint that was not recorded
      # angle: Position                # instead of joints: the joint that the sweep moves
      # orientation: [Q0, Q1, Q2, Q3]  # of a 6-D probe; then the two lines below
      # sigma: [sX, sY, sZ]            # with sigma: columns; or covariance: [cxx, cxy, cxz, cyy, cyz, czz]
      # time: Time                     # then time below
    # sweep: A1                        # when the whole table is of one sweep; or columns.sweep; or, as here,
    point_names: "{sweep}_{number}"    # within the names of the points; or a list of such patterns
    # reflector: R1                    # when the whole table is of one reflector
    # orientation: quaternion-wxyz     # docs/formats.md lists them
    # direction: T_tracker_reflector   # the reflector seen from the tracker; or T_reflector_tracker
    # coverage: 2                      # when sigma or covariance are for k = 2
    # time: {unit: s}                  # or {format: "%d.%m.%Y %H:%M:%S.%f"}
    # at: [~, 0, 0, 0, 30, 0]          # joints that stood still for the whole table
    # joints_file:                     # joint values that the controller wrote, row by row beside the points
    #   file: joints.txt
    #   header: none
    #   columns: [1, 2, 3, 4, 5, 6]
"""

_POINTS = """\
Name,X,Y,Z,Reflector,J1,J2,J3,J4,J5,J6
A1_01,2612.205,191.58,-27.451,R1,-60,0,0,0,30,0
A1_02,2474.453,504.964,-217.278,R1,-50,0,0,0,30,0
A1_03,2744.596,567.169,39.155,R1,-40,0,0,0,30,0
A2_01,3024.451,306.943,190.202,R2,0,-60,0,0,30,0
A2_02,3042.233,19.083,-193.218,R2,0,-50,0,0,30,0
cloud_01,2825.132,292.561,82.153,R1,12,-17,5,58,19,-52
N1,1994.294,321.271,262.214,N1,,,,,,
"""


def write_tracker_skeleton(folder: Path) -> list[Path]:
    """Write a commented ``tracker.yaml`` and a ``points.csv`` with example rows.

    Args:
        folder: The folder; it is created when missing.

    Returns:
        The files that were written.

    Raises:
        InputError: One of the files exists already; nothing is written.
        OSError: The folder cannot be written.
    """
    return write_new_files({folder / "tracker.yaml": _TRACKER, folder / "points.csv": _POINTS})
