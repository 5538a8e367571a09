"""Recordings of touches: what is wrong with one is said where it stands, all at once."""

from __future__ import annotations

import pytest
from example_recording import changed, findings_of, write_example

from sixthlink.files import read_recording, write_recording

RECORDING = """\
schema: sixthlink-recording/1
name: sockets
units: {length: mm, angle: rad}
robot: {name: franka_panda, positions: joints}
length_standard: {length: 50, uncertainty: 0.1, mark: socket, marks: [left, right]}
observations: touches
"""

SHOTS = """\
shot,placement,kind,mark,q1,q2,q3,q4,q5,q6,q7
t1,front,calibrate,left,0.1,0.2,0.3,-1.4,0.5,1.6,0.7
t2,front,calibrate,left,0.2,0.2,0.3,-1.4,0.5,1.6,0.7
t3,front,calibrate,right,0.3,0.2,0.3,-1.4,0.5,1.6,0.7
t4,back,verify,left,0.4,0.2,0.3,-1.4,0.5,1.6,0.7
t5,back,verify,right,0.5,0.2,0.3,-1.4,0.5,1.6,0.7
"""


def test_a_recording_of_touches_is_read_and_survives_a_round_trip(tmp_path):
    recording = read_recording(write_example(tmp_path / "a", RECORDING, SHOTS))
    assert recording.touched
    assert recording.standard.marks == ("left", "right")
    assert recording.standard.length_m == pytest.approx(0.05)
    assert recording.joints[0].tolist() == [0.1, 0.2, 0.3, -1.4, 0.5, 1.6, 0.7]
    write_recording(tmp_path / "b", recording, robot={"name": "franka_panda"})
    again = read_recording(tmp_path / "b")
    assert again.touched
    assert again.standard == recording.standard
    assert again.marks == recording.marks
    assert again.joints == pytest.approx(recording.joints, abs=1e-12)


def test_one_socket_without_a_known_distance_is_a_recording_too(tmp_path):
    recording = RECORDING.replace(RECORDING.splitlines()[4], "length_standard: none")
    shots = "\n".join([*SHOTS.splitlines()[:3], "t3,front,calibrate,left,0.3,0.2,0.3,-1.4,0.5,1.6,0.7"])
    assert read_recording(write_example(tmp_path, recording, shots)).standard is None


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (
            ("observations: touches", "observations: touches\nmount: eye-in-hand\nhead: {cameras: none}"),
            "recording.yaml:7:1: mount: is not for observations: touches; remove it",
        ),
        (
            ("mark: socket,", "mark: quadrant, mark_diameter: 24,"),
            "recording.yaml:5:55: length_standard.mark: is quadrant, expected socket for observations: touches, and "
            "only there; write how the ends of the standard are found",
        ),
        (
            ("mark: socket,", "mark: socket, mark_diameter: 24,"),
            "recording.yaml:5:63: length_standard.mark_diameter: is not for sockets; remove it",
        ),
        (
            ("positions: joints", "positions: flange-poses, orientation: abb, direction: T_base_flange"),
            "recording.yaml:4:40: robot.positions: is flange-poses, expected joints for observations: touches; record "
            "joint values, and name the robot",
        ),
        (
            ("marks: [left, right]", "marks: [left, rigt]"),
            "shots.csv: mark: no shot touches 'rigt', a mark of the length standard, expected touches of left and "
            "rigt; did you mean right?",
        ),
    ],
)
def test_what_does_not_belong_to_touches_is_named(tmp_path, change, finding):
    assert finding in findings_of(write_example(tmp_path, changed(RECORDING, change), SHOTS))


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (
            ("t2,front,calibrate,left", "t2,front,calibrate,"),
            "shots.csv:3:4: mark: is empty, expected the name of a socket; name the socket that the ball was in",
        ),
        (
            ("t4,back,verify", "t4,back,scale"),
            "shots.csv:5:3: kind: is 'scale', expected one of calibrate, judge, verify; write one of them",
        ),
        (
            ("t1,front,calibrate,left,0.1,0.2,0.3,-1.4", "t1,front,calibrate,left,0.1,0.2,0.3,1.4"),
            "shots.csv:2:8: q4: is 1.4 in shot t1, expected -3.0718 to -0.0698, the limits of Franka Emika Panda; "
            "check unit, sign and order of the joints; other limits belong in an arm file",
        ),
    ],
)
def test_what_is_wrong_with_a_touch_is_named(tmp_path, change, finding):
    assert finding in findings_of(write_example(tmp_path, RECORDING, changed(SHOTS, change)))


def test_everything_is_said_at_once(tmp_path):
    recording = changed(RECORDING, ("observations: touches", "observations: touches\ntarget: none"))
    shots = changed(SHOTS, ("t2,front,calibrate,left", "t2,front,calibrate,"), ("t4,back,verify", "t4,back,scale"))
    assert len(findings_of(write_example(tmp_path, recording, shots))) == 3


def test_a_seen_standard_still_needs_its_diameter(tmp_path):
    from example_recording import RECORDING as SEEN

    spoiled = changed(SEEN, (", mark_diameter: 24", ""))
    assert any(
        f.startswith("recording.yaml:18:1: length_standard.mark_diameter: is missing")
        for f in findings_of(write_example(tmp_path, spoiled))
    )
