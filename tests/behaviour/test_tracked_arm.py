"""An arm from a tracker's points: as good as the points allow, and every simple mistake is named, not averaged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sixthlink.calibrate.tracked_arm import TrackedArm, calibrate_arm_by_tracker
from sixthlink.errors import CalibrationError, TooFewShotsError
from sixthlink.progress import Silent
from sixthlink.recording import TrackerRecord
from sixthlink.simulate import TrackerSession, simulate_tracking
from tracking import SCENARIO, fresh_errors_m, irb1400, moved_points, rows_of, session

SMALL = {"stops": 15, "free_points": 40}


@pytest.fixture(scope="module")
def record() -> TrackerRecord:
    return session(**SMALL).record


def arm_of(record: TrackerRecord) -> TrackedArm:
    return calibrate_arm_by_tracker(record, Silent())


def refused(record: TrackerRecord) -> str:
    with pytest.raises(CalibrationError) as caught:
        arm_of(record)
    return str(caught.value)


def grave(found: TrackedArm) -> dict[str, str]:
    return {f.finding.kind: f"{f.where}: {f.finding.words}" for f in found.findings if f.finding.grave}


@pytest.mark.parametrize("seed", [0, 1])
def test_six_sweeps_and_sixty_points_make_the_arm(seed):
    """Links off by 0.5 mm and 0.03°, noise 0.02 mm: 0.05 mm on average at fresh poses, 0.15 mm at most."""
    sim = session(seed)
    found = arm_of(sim.record)
    assert found.accepted, [g.message for g in found.gates if not g.passed]
    errors = fresh_errors_m(found, sim, seed=seed)
    assert errors.mean() < 0.05e-3
    assert errors.max() < 0.15e-3
    off = [np.arccos(min(1.0, float(a.axis.direction @ t))) for a, t in zip(found.axes, sim.truth.axes, strict=True)]
    assert max(off) < 1e-4
    assert all(o < 4.0 * a.direction_std_rad for o, a in zip(off, found.axes, strict=True))
    true = sim.truth.arm.joint_map[sim.truth.arm.own_steps[2], 1]
    assert abs(found.couplings[0].value - true) < 1e-4
    assert abs(true + 1.0) > 1e-4
    assert found.train.rms_m < found.heldout.rms_m < 1.2 * found.train.rms_m < found.heldout_before.rms_m / 4


def test_points_without_sweeps_and_sweeps_without_points_do_too(record):
    """Where no reflector on the flange turned with every joint, the arm is still refined."""
    for part in (record.sweep_of == 6, record.sweep_of < 6):
        found = arm_of(rows_of(record, part))
        assert found.accepted
        assert found.heldout.rms_m < 0.12e-3


def test_a_modest_spread_says_what_it_does_not_see(record):
    """With joints 1 and 2 alone the wrist's numbers stay nominal and say so."""
    found = arm_of(rows_of(record, record.sweep_of < 2))
    free = {p.name for p in found.joint.arm if p.free}
    assert not free & {"alpha4", "a5", "d6", "theta6"}
    assert all(p.reason for p in found.joint.arm if not p.free)


def test_a_reflector_that_only_one_joint_moved_is_not_seen(record):
    found = arm_of(rows_of(record, record.sweep_of == 0))
    assert not found.accepted
    assert "R1: where it sits on link 6 is not seen" in next(g.message for g in found.gates if not g.passed)
    assert np.isinf(found.reflectors[0].std_m).any()


def test_outliers_are_named_and_the_arm_does_not_suffer():
    sim = session(outliers=8, outlier_m=5e-3, **SMALL)
    found = arm_of(sim.record)
    names = {r.shot for r in found.rejections}
    assert names >= {sim.record.names[i] for i in sim.truth.outliers}
    assert len(names) <= 9
    assert fresh_errors_m(found, sim).mean() < 0.05e-3


def test_a_tracker_that_moved_is_told_by_its_reference_points():
    found = arm_of(session(drift_m=0.2e-3, drift_before=3, **SMALL).record)
    assert not found.accepted
    assert "between sweeps A3 and A4 the reference points shifted by" in grave(found)["tracker moved"]


def test_no_reference_points_no_word_of_a_still_tracker(record):
    found = arm_of(rows_of(record, record.sweep_of == 6))
    assert "drift not checked" in {f.finding.kind for f in found.findings}
    assert "not checked" in next(g.message for g in found.gates if g.name == "tracker stood still")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p / 25.4, "0.0394 times those of the arm: they look like inches, where millimetres were declared"),
        (lambda p: p / 1000, "they look like metres, where millimetres were declared"),
        (lambda p: p * [1, -1, 1], "they fit when mirrored"),
        (lambda p: p[:, [1, 0, 2]], "they fit when mirrored"),
    ],
    ids=["inches", "metres", "mirrored", "columns exchanged"],
)
def test_a_wrong_unit_or_a_left_handed_frame_is_named(record, change, words):
    assert words in refused(moved_points(record, change))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda q: q[:, [0, 1, 2, 4, 3, 5]], "the columns of q4 and q5 change places"),
        (lambda q: q[:, [0, 2, 1, 3, 4, 5]], "the columns of q2 and q3 change places"),
        (lambda q: q * [1, 1, 1, 1, -1, 1], "q5 counts backwards"),
        (lambda q: q * [-1, 1, 1, 1, 1, 1], "q1 counts backwards"),
        (lambda q: q + np.array([0, 0, np.pi / 2, 0, 0, 0]), "q3 counts from another zero, -90° away"),
    ],
    ids=["4 and 5", "2 and 3", "5 backwards", "1 backwards", "3 from another zero"],
)
def test_wrong_joint_columns_are_named(record, change, words):
    assert words in refused(replace(record, joints=change(record.joints)))


def test_rows_out_of_step_are_named(record):
    free = rows_of(record, record.sweep_of == 6)
    assert "every point has the joints of one row" in refused(replace(free, joints=np.roll(free.joints, 1, axis=0)))


def test_a_coupling_that_the_file_forgot_is_named(record):
    nominal = irb1400()
    joint_map = nominal.joint_map.copy()
    joint_map[nominal.own_steps[2], 1] = 0.0
    words = refused(replace(record, arm=replace(nominal, joint_map=joint_map)))
    assert "a coupling of q3 to q2 with factor -1" in words


def test_lost_mastering_is_found_and_told(record):
    sim = session(**SMALL)
    found = arm_of(replace(sim.record, joints=sim.record.joints + np.deg2rad([0.0, 0.0, 20.0, 0.0, 0.0, 0.0])))
    assert found.accepted
    (zeros,) = (f.finding.words for f in found.findings if f.finding.kind == "joint zeros")
    assert "q3 -20" in zeros
    assert found.heldout.rms_m < 0.1e-3


def test_the_wrong_joint_is_named(record):
    """The record says that joint 5 was swept, but joint 4 was."""
    sim = session(**SMALL)
    q, swept = record.joints.copy(), record.sweep_of == 4
    q[swept, 3], q[swept, 4] = q[swept, 4] - q[swept, 4].mean(), q[0, 4]
    points = record.points.copy()
    points[swept] = sim.truth.seen_at(q[swept], "R1", 6)
    found = arm_of(replace(record, points=points))
    assert not found.accepted
    assert "A5: its axis is" in grave(found)["wrong joint"]
    assert "lies on that of q4: q4 moved" in grave(found)["wrong joint"]


def test_two_joints_at_once_are_named(record):
    sim = session(**SMALL)
    q, swept = record.joints.copy(), record.sweep_of == 4
    q[swept, 3] = 0.1 * (q[swept, 4] - q[swept, 4].mean())
    points = record.points.copy()
    points[swept] = sim.truth.seen_at(q[swept], "R1", 6)
    found = arm_of(replace(record, points=points))
    assert "A5: " in grave(found)["path beside the circle"]
    assert "a second joint moved too" in grave(found)["path beside the circle"]


def test_a_reflector_behind_the_parallelogram_is_told_and_used(record):
    """On the flange it does not show axis 2; its points still refine arm and coupling."""
    found = arm_of(rows_of(record, (record.sweep_of < 6) & (record.reflector_of == 0)))
    assert found.accepted
    (told,) = (f.finding.words for f in found.findings if f.finding.kind == "behind a coupling")
    assert "R1 rides behind the coupling of joint 3 to joint 2" in told
    assert found.couplings[0].std < 1e-4


def test_points_whose_joints_nobody_wrote_down_are_set_aside(record):
    known = record.joints_known.copy()
    known[:10, 3:] = False
    found = arm_of(replace(record, joints=np.where(known, record.joints, 0.0), joints_known=known))
    aside = [r for r in found.rejections if "not all joints" in r.reason]
    assert len(aside) == 10
    assert found.accepted


def test_too_few_points_are_refused_with_their_number(record):
    with pytest.raises(TooFewShotsError, match="5 points with all their joint values recorded"):
        arm_of(rows_of(record, np.arange(5)))


def test_an_arm_without_drawing_comes_from_its_axes_alone():
    """Nothing is known but that six joints turn; distances that the arm spans come out true."""
    nominal = irb1400()
    uncoupled = replace(nominal, joint_map=np.where(nominal.joint_map < 0.0, 0.0, nominal.joint_map))
    sim = simulate_tracking(SCENARIO, replace(TrackerSession(), **SMALL), uncoupled, seed=3)
    found = arm_of(replace(sim.record, arm=None))
    assert not found.drawn
    assert found.accepted
    assert fresh_errors_m(found, sim).max() < 0.3e-3


def test_an_axis_that_nobody_swept_is_missed_without_a_drawing(record):
    words = refused(replace(rows_of(record, record.sweep_of != 3), arm=None))
    assert "no usable sweep shows that of joint" in words
    assert "4" in words
