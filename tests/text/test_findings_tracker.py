"""Each mistake in a tracker record is named in words, at its row and cell, with a cure."""

from pathlib import Path

import numpy as np
import pytest
from example_recording import changed

from sixthlink.errors import InputError
from sixthlink.files import read_tracker_record
from sixthlink.recording import TrackerRecord

YAML = """\
schema: sixthlink-tracker/1
name: example
instrument: Leica AT960
units: {length: mm, angle: deg}
robot: {name: abb_irb1400}
sigma: 0.02
reflectors: {R1: 6, R2: 2, N1: ground}
sweeps: {A1: 1, A2: 2, cloud: free}
tables:
  - file: points.csv
    columns: {joints: [J1, J2, J3, J4, J5, J6]}
    point_names: "{sweep}_{number}"
"""

POINTS = """\
Name,X [mm],Y [mm],Z [mm],Reflector,J1,J2,J3,J4,J5,J6
A1_01,2612.205,191.58,-27.451,R1,-60,0,0,0,30,0
A1_02,2474.453,504.964,-217.278,R1,-50,0,0,0,30,0
A2_01,3024.451,306.943,190.202,R2,0,-60,0,0,30,0
cloud_01,2825.132,292.561,82.153,R1,12,-17,5,58,19,-52
N1,1994.294,321.271,262.214,N1,,,,,,
"""

NUMBER = "expected a finite number with a decimal point; correct it, or take the row out"


def write_record(folder: Path, yaml: str = YAML, points: str | bytes = POINTS, **others: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tracker.yaml").write_text(yaml, encoding="utf-8")
    (folder / "points.csv").write_bytes(points if isinstance(points, bytes) else points.encode())
    for name, text in others.items():
        (folder / name.replace("_", ".")).write_text(text, encoding="utf-8")
    return folder


def findings_of(folder: Path) -> list[str]:
    with pytest.raises(InputError) as caught:
        read_tracker_record(folder)
    return [str(f).replace(f"{folder}/", "") for f in caught.value.findings]


MISTAKES: dict[str, tuple[list[tuple[str, str]], list[tuple[str, str]], list[str]]] = {
    "thousands or decimals": (
        [],
        [(POINTS, "Name;X;Y;Z;Reflector;J1;J2;J3;J4;J5;J6\nA1_1;1,234;2,345;3,456;R1;1;2;3;4;5;6\n")],
        [
            "points.csv:2:2: X: is '1,234': with a decimal comma, or a thousands separator?, expected a "
            "table whose numbers settle it; write decimal: comma if that is so, or export without "
            "thousands separators",
        ],
    ),
    "points for thousands": (
        [],
        [(POINTS, "Name;X;Y;Z;Reflector;J1;J2;J3;J4;J5;J6\nA1_1;1.234;2.345;3.456;R1;1;2;3;4;5;6\n")],
        [
            "points.csv:2:2: X: is '1.234': with a decimal point, or a thousands separator?, expected a "
            "table whose numbers settle it; write decimal: point if that is so, or export without "
            "thousands separators",
        ],
    ),
    "mixed marks": (
        [],
        [(POINTS, "Name;X;Y;Z;Reflector;J1;J2;J3;J4;J5;J6\nA1_1;1,5;2.345,5;3.45;R1;1;2;3;4;5;6\n")],
        [
            "points.csv:2:3: Y: is '2.345,5', expected a finite number with a decimal comma; correct it, "
            "or take the row out",
            "points.csv:2:4: Z: is '3.45', expected a finite number with a decimal comma; correct it, or "
            "take the row out",
        ],
    ),
    "unit missing": (
        [("units: {length: mm, angle: deg}", "units: {length: mm}")],
        [],
        [
            'tracker.yaml:4:1: units.angle: is missing; write it, for example "angle: deg"',
        ],
    ),
    "units missing": (
        [("units: {length: mm, angle: deg}\n", "")],
        [],
        [
            'tracker.yaml:1:1: units: is missing; write it, for example "units: {length: mm, angle: deg}"',
        ],
    ),
    "unit of the header": (
        [],
        [("X [mm]", "X [in]")],
        [
            "points.csv:1:2: X [in]: has the unit in, expected mm, as declared; correct units in "
            "tracker.yaml (or units of this table), or export the table again",
        ],
    ),
    "unit row": (
        [],
        [("J5,J6\n", "J5,J6\n,mm,mm,inch,,rad,,,,,\n"), ("Z [mm]", "Z")],
        [
            "points.csv:2:4: Z: has the unit in, expected mm, as declared; correct units in tracker.yaml "
            "(or units of this table), or export the table again",
            "points.csv:2:6: J1: has the unit rad, expected deg, as declared; correct units in "
            "tracker.yaml (or units of this table), or export the table again",
        ],
    ),
    "unit unknown": (
        [],
        [("J5,J6\n", "J5,J6\n,mm,furlong,mm,,,,,,,\n")],
        [
            "points.csv:2:3: Y [mm]: has 'furlong' for a unit, expected mm, as declared; correct units in"
            " tracker.yaml (or units of this table), or export the table again",
        ],
    ),
    "column twice": (
        [],
        [("Y [mm]", "X [mm]")],
        [
            "points.csv:1: y: no column is known to be this, expected one of the columns Name, X [mm], X "
            "[mm], Z [mm], Reflector, J1, J2, J3, J4, J5, J6; name it in tracker.yaml, for example "
            '"columns: {y: 3}"',
            "points.csv:1:3: x: may be column 2 or 3, expected one column; rename one of them, or write "
            "the number of the column in tracker.yaml",
        ],
    ),
    "column missing": (
        [],
        [("Z [mm]", "Height")],
        [
            "points.csv:1: z: no column is known to be this, expected one of the columns Name, X [mm], Y "
            "[mm], Height, Reflector, J1, J2, J3, J4, J5, J6; name it in tracker.yaml, for example "
            '"columns: {z: 3}"',
        ],
    ),
    "column named and missing": (
        [("J3, J4", "J33, J4")],
        [],
        [
            "points.csv:1: J33: the column is missing, expected one of the columns Name, X [mm], Y [mm], "
            "Z [mm], Reflector, J1, J2, J3, J4, J5, J6; did you mean J3?",
        ],
    ),
    "two candidates": (
        [],
        [("J6\n", "J6,X\n"), ("30,0\n", "30,0,1\n"), ("-52\n", "-52,1\n"), (",,,,,,\n", ",,,,,,,1\n")],
        [
            "points.csv:1:12: x: may be column 2 or 12, expected one column; rename one of them, or write"
            " the number of the column in tracker.yaml",
        ],
    ),
    "short and long row": (
        [],
        [("A1_02,2474.453,504.964,", "A1_02,2474.453,"), ("R2,0", "R2,0,0")],
        [
            "points.csv:3: row: has 10 cells, expected 11, separated by commas; complete the row, or take it out",
            "points.csv:4: row: has 12 cells, expected 11, separated by commas; complete the row, or take it out",
        ],
    ),
    "no numbers": (
        [],
        [("2612.205", "nan"), ("504.964", "-inf"), ("306.943", ""), ("292.561", "1_0"), ("-52", "1e999")],
        [
            "points.csv:2:2: X [mm]: is 'nan', expected a finite number with a decimal point; correct it,"
            " or take the row out",
            "points.csv:3:3: Y [mm]: is '-inf', expected a finite number with a decimal point; correct "
            "it, or take the row out",
            "points.csv:4:3: Y [mm]: is empty, expected a finite number with a decimal point; correct it,"
            " or take the row out",
            "points.csv:5:3: Y [mm]: is '1_0', expected a finite number with a decimal point; correct it,"
            " or take the row out",
            "points.csv:5:11: J6: is '1e999', expected a finite number with a decimal point; correct it, "
            "or take the row out",
        ],
    ),
    "joint outside": (
        [],
        [("-60,0,0,0,30,0", "-60,0,0,0,30,301"), ("-50", "-500")],
        [
            "points.csv:2:11: J6: is '301', expected -300 to 300, the limits of joint 6 of ABB IRB 1400; "
            "check unit, sign and order of the joints; other limits belong in an arm file",
            "points.csv:3:6: J1: is '-500', expected -170 to 170, the limits of joint 1 of ABB IRB 1400; "
            "check unit, sign and order of the joints; other limits belong in an arm file",
        ],
    ),
    "sweep unknown": (
        [],
        [("A2_01", "A7_01"), ("cloud_01", "=cmd|calc")],
        [
            "points.csv:4:1: Name: is 'A7_01', expected a name like {sweep}_{number} with one of A1, A2, "
            "cloud, R1, R2, N1; correct the name, or point_names in tracker.yaml",
            "points.csv:5:1: Name: is '=cmd|calc', expected a name like {sweep}_{number} with one of A1, "
            "A2, cloud, R1, R2, N1; correct the name, or point_names in tracker.yaml",
        ],
    ),
    "reflector unknown": (
        [],
        [("R2,0", "\x1b[31mR9,0")],
        [
            "points.csv:4:5: Reflector: is '\\x1b[31mR9', expected one of R1, R2, N1; correct it, or name"
            " it in tracker.yaml",
        ],
    ),
    "reflector that does not move": (
        [("R1: 6", "R1: 1"), ("A2: 2", "A2: 3"), ("R2: 2", "R2: 2")],
        [("N1,1994", "N1,1994")],
        [
            "points.csv:4:5: Reflector: reflector 'R2' sits on link 2, which joint 3 does not move, "
            "expected link 3 or one behind it in sweep 'A2'; correct reflectors or sweeps in tracker.yaml",
        ],
    ),
    "declared in vain": (
        [("A2: 2", "A2: 2, A3: 3"), ("R2: 2", "R2: 2, R5: 5")],
        [],
        [
            "tracker.yaml:7:28: reflectors.R5: has no point in any table, expected points of every "
            "reflector; add its table, or remove it",
            "tracker.yaml:8:24: sweeps.A3: has no point in any table, expected points of every sweep; add"
            " its table, or remove it",
        ],
    ),
    "joint and link that do not exist": (
        [("A2: 2", "A2: 7"), ("R2: 2", "R2: 9")],
        [],
        [
            "tracker.yaml:7:25: reflectors.R2: is 9, expected 1 to 6, the links of ABB IRB 1400; write "
            "the number of the joint that moves the link by itself, or ground",
            "tracker.yaml:8:21: sweeps.A2: is 7, expected 1 to 6, the joints of ABB IRB 1400; write the "
            "number of the joint that moved, or free",
        ],
    ),
    "file missing": (
        [("points.csv", "../points.csv")],
        [],
        [
            "tracker.yaml:10:11: tables[0].file: '../points.csv' leaves the folder of the record, "
            "expected a file in the folder of the record; copy the file into the folder and correct the "
            "path",
        ],
    ),
    "a point like a comment": (
        [],
        [("A1_02", "#A1_02")],
        [
            "points.csv:3: row: begins with '#' like a comment, but has the numbers of a point, expected "
            "a point or a comment; put the name of the point in quotes, or take the line out",
        ],
    ),
    "no rows": (
        [],
        [(POINTS, "Name,X,Y,Z\n")],
        [
            "points.csv: table: has no rows, expected a header and rows below it; check that it is the right file",
        ],
    ),
    "quote": (
        [],
        [("A1_01", '"A1_01')],
        [
            "points.csv:2: row: is not a table: unexpected end of data; look for a quote that is not closed",
        ],
    ),
    "pattern": (
        [('"{sweep}_{number}"', '"{axis}_{number}"')],
        [],
        [
            "tracker.yaml:12:18: tables[0].point_names: is '{axis}_{number}', expected {sweep}, "
            "{reflector} or both, each once, and {number} where a number stands; write for example "
            '"{sweep}_{number}"',
        ],
    ),
    "wrong list of joints": (
        [("J5, J6]", "J5]")],
        [],
        [
            "tracker.yaml:11:23: tables[0].columns.joints: is a list of 5, expected 6, one per joint of "
            "ABB IRB 1400; write ~ for a joint that was not recorded",
        ],
    ),
    "radians": (
        [("angle: deg", "angle: rad")],
        [],
        [
            "tracker.yaml:10:5: tables[0].units.angle: is rad, but a joint is at 60, more than two turns:"
            " that looks like degrees, expected the unit of the joint values; correct units.angle; or, if"
            " it is right, write robot.joints_confirmed: true",
        ],
    ),
    "looks like radians": (
        [],
        [
            (
                POINTS,
                "Name,X,Y,Z,Reflector,J1,J2,J3,J4,J5,J6\nA1_1,1,2.5,3,R1,0.1,0,0,0,1,0\nA1_2,1,2.5,3,R1,0.2,0,0,0,1,0\nA1_3,1,2.5,3,R1,0.3,0,0,0,1,0\nA1_4,1,2.5,3,R1,0.4,0,0,0,1,0\nA1_5,1,2.5,3,R1,0.5,0,0,0,1,0\nA1_6,1,2.5,3,R1,0.6,0,0,0,1,0\n",
            )
        ],
        [
            "tracker.yaml:10:5: tables[0].units.angle: is deg, but no joint of the table is beyond 1: "
            "that looks like radians, expected the unit of the joint values; correct units.angle; or, if "
            "it is right, write robot.joints_confirmed: true",
        ],
    ),
    "orientation alone": (
        [("point_names", "orientation: abb\n    point_names")],
        [],
        [
            "tracker.yaml:12:5: tables[0].orientation: has no columns, expected columns.orientation; "
            "write for example 'columns: {orientation: [qx, qy, qz, qw]}', or remove it",
        ],
    ),
    "orientation": (
        [
            ("joints: [J1, J2, J3, J4, J5, J6]", "joints: [J1, ~, ~, ~, ~, ~], orientation: [J2, J3, J4]"),
            ("point_names", "orientation: quaternion-wxyz\n    point_names"),
        ],
        [],
        [
            "tracker.yaml:10:5: tables[0].direction: is missing, expected the way an orientation is "
            'written, and the way it points, beside columns.orientation; write for example "direction: '
            'T_tracker_reflector"',
            "tracker.yaml:11:57: tables[0].columns.orientation: is a list of 3, expected 4: qw qx qy qz; "
            "write them in that order",
        ],
    ),
    "noise": (
        [("sigma: 0.02", "sigma: columns")],
        [],
        [
            "tracker.yaml:11:14: tables[0].columns: sigma is columns, but none is named, expected sigma "
            "or covariance; write for example 'columns: {sigma: [sx, sy, sz]}'",
        ],
    ),
    "noise negative": (
        [("sigma: 0.02", "sigma: -1")],
        [],
        [
            "tracker.yaml:6:8: sigma: is -1, expected a number above 0, {range: ..., angle: ...}, columns"
            " or unknown; write one of these",
        ],
    ),
    "time": (
        [("columns: {", "columns: {time: J1, ")],
        [],
        [
            "tracker.yaml:10:5: tables[0].time: is missing, expected either the unit or the format of the"
            " times; write for example 'time: {unit: s}' or 'time: {format: \"%d.%m.%Y %H:%M:%S.%f\"}'",
        ],
    ),
    "keys": (
        [
            ("sigma: 0.02", "sigma: {range: 1, angel: 2}"),
            ("point_names:", "pointnames:"),
            ("name: example", "nam: example"),
        ],
        [],
        [
            'tracker.yaml:1:1: name: is missing; write it, for example "name: left cell, March"',
            "tracker.yaml:2:1: nam: is not a section of a tracker record, expected schema, name, "
            "instrument, units, robot, sigma, rotation_sigma, reflectors, sweeps, tables; did you mean "
            "name?",
            'tracker.yaml:6:1: sigma.angle: is missing; write it, for example "angle: 0.0003"',
            "tracker.yaml:6:19: sigma.angel: is not a key of this file, expected range or angle; did you "
            "mean range or angle?",
            "tracker.yaml:12:5: tables[0].pointnames: is not a key of this file, expected file, sweep, "
            "reflector, header, separator, decimal, encoding, units, columns, point_names, orientation, "
            "direction, coverage, time, at or joints_file; did you mean point_names?",
        ],
    ),
    "tables of nothing": (
        [("sweeps: {A1: 1, A2: 2, cloud: free}", "sweeps: {A1: first, A2: 0, cloud: true}")],
        [],
        [
            "tracker.yaml:8:14: sweeps.A1: is the text 'first', expected the number of a joint from 1, or"
            " free; write one of these",
            "tracker.yaml:8:25: sweeps.A2: is 0, expected the number of a joint from 1, or free; write one of these",
            "tracker.yaml:8:35: sweeps.cloud: is true, expected the number of a joint from 1, or free; "
            "write one of these",
        ],
    ),
}


@pytest.mark.parametrize("yaml, points, messages", [pytest.param(*m, id=k) for k, m in MISTAKES.items()])
def test_mistakes(
    tmp_path: Path, yaml: list[tuple[str, str]], points: list[tuple[str, str]], messages: list[str]
) -> None:
    folder = write_record(tmp_path, changed(YAML, *yaml), changed(POINTS, *points))
    assert findings_of(folder) == messages


def one_table(table: str, *, sweeps: str = "A1: 1", reflectors: str = "R1: 6", file: str = "points.csv") -> str:
    text = YAML[: YAML.index("tables:")].replace("R1: 6, R2: 2, N1: ground", reflectors)
    text = text.replace("A1: 1, A2: 2, cloud: free", sweeps)
    return f"{text}tables:\n  - {{file: {file}, {table}}}\n"


def read(folder: Path) -> TrackerRecord:
    return read_tracker_record(folder)


def test_points_as_spatialanalyzer_writes_them(tmp_path: Path) -> None:
    """No header, comments, the name of the target as the only name, three reflectors at one pose after the other."""
    yaml = one_table('header: none, columns: {point: 1, x: 2, y: 3, z: 4}, point_names: "{reflector}", sweep: cloud',
                     sweeps="cloud: free", reflectors="{1: 6, 2: 6, 3: ground}"[1:-1])  # fmt: skip
    points = (
        "// SpatialAnalyzer 2022.3, working frame A::WORLD\n\n"
        "1,  2296.497861,  -2416.256713,  -442.566334\n"
        "2,  2331.149279,  -2328.099578,  -547.654703\n"
        "3,  2421.789172,  -2348.284506,  -386.432482\n"
        "1,  2296.490190,  -2416.262339,  -442.579183\n"
    )
    record = read(write_record(tmp_path, yaml, points))
    assert record.reflector_of.tolist() == [0, 1, 0] and record.names == ("1", "2", "1")
    np.testing.assert_allclose(record.points[1], [2.331149279, -2.328099578, -0.547654703])
    assert record.references is not None and record.references.after.tolist() == [2]


LEICA = (
    "X  [mm],Y  [mm],Z  [mm],U(95)  [mm],U(95) X  [mm],U(95) Y  [mm],U(95) Z  [mm],Tilt  [deg],Q0 ,Q1 ,Q2 ,Q3 ,"
    "Image RMS  [µm],Target,Temperature  [°C],Time Stamp,OTG Applied,Delete\n"
    "754,-3193.366,303.745,0.004,0.003,0.001,0.003,29.9385,0.6,0,0.8,0,0.22,TMC 30-B #5320,22.8,"
    "'11.10.2022 15:06:48.043,FALSE,\n"
    "835.44,-3148.711,256.682,0.01,0.008,0.002,0.005,32.2784,1,0,0,0,0.35,TMC 30-B #5320,22.8,"
    "'11.10.2022 15:06:55.562,FALSE,\n"
)


def test_6d_points_as_leica_writes_them(tmp_path: Path) -> None:
    yaml = one_table(
        "encoding: cp1252, sweep: cloud, reflector: R1, orientation: quaternion-wxyz, direction: T_tracker_reflector, "
        "coverage: 2, time: {format: '%d.%m.%Y %H:%M:%S.%f'}, columns: {orientation: [Q0, Q1, Q2, Q3], "
        "sigma: ['U(95) X', 'U(95) Y', 'U(95) Z'], time: Time Stamp}, "
        "joints_file: {file: joints.txt, header: none, columns: [1, 2, 3, 4, 5, 6]}",
        sweeps="cloud: free",
    ).replace("sigma: 0.02", "sigma: columns")
    joints = "4.998580932617187500e+00 -1.000068950653076172e+01 4.9e+00 -5.5e+01 4.1e+01 3.7e+01\n" * 2
    folder = write_record(tmp_path, yaml, LEICA.encode("cp1252"), joints_txt=joints)
    record = read(folder)
    assert record.oriented is not None and record.oriented.all() and record.joints_known.all()
    assert record.rotations is not None and record.times_s is not None and record.covariances is not None
    np.testing.assert_allclose(record.rotations[0] @ [0, 0, 1], [0.96, 0, -0.28], atol=1e-12)
    np.testing.assert_allclose(np.diff(record.times_s), 7.519, atol=1e-6)
    np.testing.assert_allclose(np.diag(record.covariances[0]), (np.array([0.0015, 0.0005, 0.0015]) * 1e-3) ** 2)
    assert set(record.inputs) == {"tracker.yaml", "points.csv", "joints.txt"}
    (folder / "joints.txt").write_text(joints + joints, encoding="utf-8")
    assert findings_of(folder) == [
        "joints.txt: table: has 4 rows, expected 2, as the table of points beside it; "
        "give both files one row per measurement"
    ]
    (folder / "tracker.yaml").write_text(yaml.replace("encoding: cp1252, ", ""), encoding="utf-8")
    (folder / "joints.txt").write_text(joints, encoding="utf-8")
    assert findings_of(folder) == [
        "points.csv: file: byte 119 is not UTF-8, expected UTF-8 text; "
        "save it as UTF-8, or name its encoding, for example encoding: cp1252"
    ]


def test_reversed_poses_are_turned_round(tmp_path: Path) -> None:
    table = (
        "sweep: A1, reflector: R1, orientation: quaternion-wxyz, direction: DIRECTION, "
        "columns: {orientation: [Q0, Q1, Q2, Q3]}"
    )
    points = "X,Y,Z,Q0,Q1,Q2,Q3\n1.5,2.5,3.5,0.6,0,0.8,0\n"
    forth, back = (
        read(write_record(tmp_path / name, one_table(table.replace("DIRECTION", name)), points))
        for name in ("T_tracker_reflector", "T_reflector_tracker")
    )
    assert forth.rotations is not None and back.rotations is not None
    np.testing.assert_allclose(back.rotations[0] @ forth.rotations[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(back.rotations[0] @ forth.points[0] + back.points[0], 0, atol=1e-15)


def test_three_reflectors_in_a_row(tmp_path: Path) -> None:
    text = one_table("", reflectors="N1: 6, N2: 6, N3: 6", sweeps="A1: 1")
    text = text[: text.index("tables:")] + "tables:\n" + "".join(
        f"  - {{file: points.csv, header: none, sweep: A1, reflector: N{k + 1}, "
        f"columns: {{x: {3 * k + 1}, y: {3 * k + 2}, z: {3 * k + 3}, joints: [16, 17, 18, 19, 20, 21]}}}}\n"
        for k in range(3)
    )  # fmt: skip
    places = "1.99e+03 3.2e+02 2.6e+02 2.03e+03 5.7e+02 9.2e+00 1.9e+03 6.7e+02 3.5e+02"
    row = f"{places} 0 0 0 0 0 0 19.6 18.5 -11.1 -81.4 -7.2 172\n"
    record = read(write_record(tmp_path, text, row * 2))
    assert record.reflector_of.tolist() == [0, 0, 1, 1, 2, 2]
    np.testing.assert_allclose(record.points[2], [2.03, 0.57, 0.0092])
    np.testing.assert_allclose(record.joints[5], np.radians([19.6, 18.5, -11.1, -81.4, -7.2, 172]))


def test_joint_of_a_sweep_beside_joints_that_stood_still(tmp_path: Path) -> None:
    table = "sweep: A2, reflector: R1, columns: {angle: Achse}, at: [10, ~, 0, ~, 30, 0]"
    points = "Punkt;X;Y;Z;Achse\r\n;[mm];[mm];[mm];[°]\r\nP1;1,5;-2500,25;3;-45,5\r\n;;;;\r\nP2;2,5;-2400,25;4;45\r\n"
    yaml = one_table(table, sweeps="A2: 2").replace("sigma: 0.02", "sigma: {range: 0.01, angle: 0.001}")
    record = read(write_record(tmp_path, yaml, points.encode("utf-16")))
    assert record.joints_known.tolist() == [[True, True, True, False, True, True]] * 2
    np.testing.assert_allclose(record.joints, np.radians([[10, -45.5, 0, 0, 30, 0], [10, 45, 0, 0, 30, 0]]))
    assert record.covariances is not None
    sight = record.points[0] / np.linalg.norm(record.points[0])
    np.testing.assert_allclose(sight @ record.covariances[0] @ sight, 1e-5**2, rtol=1e-6)
    across = np.cross(sight, [1, 0, 0]) / np.linalg.norm(np.cross(sight, [1, 0, 0]))
    noise = np.linalg.norm(record.points[0]) * np.radians(0.001)
    np.testing.assert_allclose(across @ record.covariances[0] @ across, noise**2, rtol=1e-6)


def test_header_further_down_and_another_unit(tmp_path: Path) -> None:
    points = "PolyWorks report;;;\nunits: inch;;;\n\nNom;X (in);Y (in);Z (in)\nA1_1;1,5;2,25;100\n"
    table = 'header: 4, reflector: R1, point_names: "{sweep}_{number}", units: {length: in, angle: deg}'
    record = read(write_record(tmp_path, one_table(table), points))
    np.testing.assert_allclose(record.points, [[0.0381, 0.05715, 2.54]])


def test_names_that_fit_in_two_ways_are_refused(tmp_path: Path) -> None:
    table = 'point_names: "{sweep}_{reflector}_{number}"'
    yaml = one_table(table, sweeps="A: 1, A_1: 2", reflectors="1_R: 6, R: 6")
    points = "Name,X,Y,Z\nA_1_R_01,1.5,2,3\nA_R_01,1,2,3\n"
    assert findings_of(write_record(tmp_path, yaml, points)) == [
        "points.csv:2:1: Name: is 'A_1_R_01', expected a name like {sweep}_{reflector}_{number} with one of "
        "A, A_1, 1_R, R; correct the name, or point_names in tracker.yaml"
    ]


def test_many_mistakes_are_counted(tmp_path: Path) -> None:
    points = "X,Y,Z\n" + "1,2,n/a\n" * 5000
    found = findings_of(write_record(tmp_path, one_table("sweep: A1, reflector: R1"), points))
    assert len(found) == 21 and found[0] == f"points.csv:2:3: Z: is 'n/a', {NUMBER}"
    assert found[-1] == f"points.csv:22:3: Z: 4980 more rows have the same mistake, {NUMBER}"


def test_table_that_reads_two_ways(tmp_path: Path) -> None:
    yaml = one_table("header: none, sweep: A1, reflector: R1, columns: {x: 1, y: 3, z: 4}")
    assert findings_of(write_record(tmp_path, yaml, "1,2;a,3,4,7;5;6\n")) == [
        "points.csv:1: table: reads as a table with commas and with semicolons between the cells, "
        "expected one way to read it; write which it is, for example separator: semicolon"
    ]


def test_commas_that_may_be_decimal_or_not(tmp_path: Path) -> None:
    yaml = one_table("header: none, sweep: A1, reflector: R1, columns: {x: 1, y: 2, z: 3}")
    assert findings_of(write_record(tmp_path, yaml, "1,5,2,5,3,5\n")) == [
        "points.csv:1: table: has commas only: they may stand between the cells or within the numbers, "
        "expected one way to read it; write separator: comma, or export with another separator or with decimal points"
    ]


def test_times_in_all_tables_or_in_none(tmp_path: Path) -> None:
    table = "sweep: A1, reflector: R1, columns: {time: T}, time: {unit: ms}"
    again = "  - {file: points.csv, sweep: A1, reflector: R1}\n"
    folder = write_record(tmp_path, one_table(table) + again, "X,Y,Z,T\n1.5,2,3,250\n")
    assert findings_of(folder) == [
        "tracker.yaml:11:5: tables[1]: has no times, but another table has, expected times in all tables or in none; "
        "name the column of times in every table, or in none"
    ]
    (folder / "tracker.yaml").write_text(one_table(table), encoding="utf-8")
    times = read(folder).times_s
    assert times is not None and times.tolist() == [0.25]


def test_uncertainty_of_zero_is_refused(tmp_path: Path) -> None:
    yaml = one_table("sweep: A1, reflector: R1, columns: {sigma: [S]}").replace("sigma: 0.02", "sigma: columns")
    assert findings_of(write_record(tmp_path, yaml, "X,Y,Z,S\n1.5,2,3,0.01\n1.5,2,3,0\n")) == [
        "points.csv:3:4: S: is not above 0, expected an uncertainty above 0 in every direction; "
        "give it more digits if it was rounded to 0, or write one sigma for all points"
    ]


def test_too_large_a_file(tmp_path: Path) -> None:
    folder = write_record(tmp_path, one_table("sweep: A1, reflector: R1"))
    with (folder / "points.csv").open("r+b") as file:
        file.truncate(2**28 + 1)
    assert findings_of(folder) == [
        "points.csv: file: has 268435457 bytes, expected at most 268435456; check that it is the right file"
    ]
