"""How does a tracker record become an arm?

Circles show the axes, axes the arm where no drawing is given or the drawing does not fit; all points together refine
it, with those optional parameters that unseen points ask for. What contradicts is named before anything is estimated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sixthlink.calibrate.arm import BLOCKS, link_parameters, optional_parameters
from sixthlink.calibrate.gates import noise_gate
from sixthlink.calibrate.joint import (
    MOST,
    BlockVerdict,
    Estimate,
    Standing,
    estimate,
    estimate_with_blocks,
    joint_evidence,
    standing,
)
from sixthlink.calibrate.observations import Columns, JointState
from sixthlink.calibrate.tracked_arm.axes import arm_axes, misplaced_axis, tracked_axes
from sixthlink.calibrate.tracked_arm.contradictions import EXPLAINS, refuse_contradictions
from sixthlink.calibrate.tracked_arm.extraction import Extraction, arm_without_drawing, extracted_arm
from sixthlink.calibrate.tracked_arm.heldout_points import errors_at, heldout_errors
from sixthlink.calibrate.tracked_arm.measured import TrackerData, tracker_data
from sixthlink.calibrate.tracked_arm.record_gates import record_gates
from sixthlink.calibrate.tracked_arm.reflectors import reflector_places
from sixthlink.calibrate.tracked_arm.sweeps import JointSweep, joint_sweeps, surest_sweeps, tracker_findings
from sixthlink.calibrate.tracked_arm.tracked_arm import RecordFinding, TrackedArm
from sixthlink.calibrate.tracked_arm.wrong_points import wrong_points
from sixthlink.calibrate.tracked_arm.zeros import with_other_zeros
from sixthlink.calibrate.tracker import CircleFinding
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats
from sixthlink.progress import Progress
from sixthlink.recording import TrackerRecord
from sixthlink.robot import Arm, Tolerances
from sixthlink.units import MM

__all__ = ["calibrate_arm_by_tracker"]

STAGE = "arm from a tracker"
STEPS = 5

ROBOT_M = 0.05 * MM
"""What a robot adds to the noise of a circle where nothing is known of its joints."""

UNDRAWN_LENGTH_M, UNDRAWN_ANGLE_RAD = 5.0 * MM, np.deg2rad(0.5)
"""What the numbers of an arm deserve that are known from its circles alone: hardly a prior."""


@dataclass(frozen=True, eq=False)
class _Begun:
    """What is known before the estimate: the nominal arm, and the data with the arm that the estimate starts from."""

    nominal: Arm
    drawn: bool
    sweeps: tuple[JointSweep, ...]
    seen: TrackerData
    findings: tuple[RecordFinding, ...]


def calibrate_arm_by_tracker(
    record: TrackerRecord,
    progress: Progress,
    *,
    noise: str = "estimated",
    versions: Mapping[str, str] | None = None,
) -> TrackedArm:
    """Calibrate the arm of a tracker record.

    Args:
        record: What the tracker measured.
        progress: Listener.
        noise: Joint repeatability: ``estimated``, or ``stated`` by the arm's file.
        versions: Versions of the software, for the record.

    Raises:
        TooFewShotsError: The points say hardly more than where tracker and reflectors are.
        CalibrationError: The points contradict the arm in a way that can be named, an axis is missing of an arm without
            a drawing, or the estimate does not settle.
    """
    progress.step(STAGE, 0, STEPS)
    begun = _with_drawing(record, record.arm) if record.arm is not None else _without_drawing(record)
    progress.step(STAGE, 1, STEPS)
    data = begun.seen.data
    parameters = (*link_parameters(data.arm), *optional_parameters(data.arm, "coupling"))
    first = estimate(data, noise=noise, parameters=parameters)
    progress.step(STAGE, 2, STEPS)
    # Compliance needs to know what is up, and only a drawing says so.
    left_out = {"coupling"} if begun.drawn else {"coupling", "compliance"}
    optional = [block for block in BLOCKS if block not in left_out]
    found, verdicts = estimate_with_blocks(data, noise=noise, blocks=optional, base=first)
    progress.step(STAGE, 3, STEPS)
    heldout, before = heldout_errors(data, found, begun.nominal)
    progress.step(STAGE, 4, STEPS)
    result = _result(record, begun, found, verdicts, versions or {})
    progress.step(STAGE, STEPS, STEPS)
    result = replace(result, heldout=heldout, heldout_before=before)
    return replace(result, gates=(*record_gates(result, len(record) - len(begun.seen.aside)), noise_gate(result.joint)))


def _with_drawing(record: TrackerRecord, nominal: Arm) -> _Begun:
    seen = tracker_data(record, nominal)
    at = standing(nominal, seen.data.outside)
    sweeps = joint_sweeps(record, nominal, _with_joint_noise(record, seen, at))
    findings = _findings(record, sweeps)
    fits = refuse_contradictions(seen.data, at)
    if not fits:
        better = _better_start(record, seen, at, extracted_arm(nominal, surest_sweeps(record, sweeps)))
        if better is not None:
            arm, finding = better
            return _Begun(
                nominal, True, sweeps, tracker_data(record, arm), (*findings, RecordFinding("record", finding))
            )
    for sweep in sweeps:
        lines = arm_axes(nominal, at.Ts_base_instrument[0], sweep.stop)
        misplaced = misplaced_axis(sweep, lines, nominal.joints) if sweep.usable and fits else None
        if misplaced is not None:
            findings = (*findings, RecordFinding(sweep.name, misplaced))
    return _Begun(nominal, True, sweeps, seen, findings)


def _better_start(
    record: TrackerRecord, seen: TrackerData, at: Standing, shown: Extraction | None
) -> tuple[Arm, CircleFinding] | None:
    """An arm that fits the points far better than the nominal one: by other zeros of its joints, or by its axes."""
    was = f"{MOST:.0%} of the points lie up to {at.most_m / MM:.3g} mm off the nominal arm, "
    zeroed, words = with_other_zeros(seen.data)
    left = standing(zeroed, seen.data.outside).most_m
    if left < EXPLAINS * at.most_m:
        words = f"{was}{left / MM:.3g} mm when its joints count from other zeros: {words}; these are the start instead"
        return zeroed, CircleFinding("joint zeros", words, {"left_m": left}, grave=False)
    if shown is None:
        return None
    left = standing(shown.arm, seen.data.outside).most_m
    if left > EXPLAINS * at.most_m:
        return None
    words = (
        f"{was}{left / MM:.3g} mm off the arm that the axes of the sweeps show: the numbers of the nominal arm are "
        "wrong, not merely inexact; those of the axes are the start instead, with wide tolerances"
    )
    loose = replace(shown.arm, length_tolerance_m=UNDRAWN_LENGTH_M, angle_tolerance_rad=UNDRAWN_ANGLE_RAD)
    return loose, CircleFinding("nominal arm", words, {"left_m": left}, grave=False)


def _without_drawing(record: TrackerRecord) -> _Begun:
    stated = record.covariances
    sweeps = joint_sweeps(record, None, None if stated is None else stated + ROBOT_M**2 * np.eye(3))
    surest = surest_sweeps(record, sweeps)
    J = record.joints.shape[1]
    missing = [j + 1 for j in range(J) if j not in surest]
    if missing:
        told = [f"{s.name}: {f}" for s in sweeps for f in s.findings if f.grave]
        raise CalibrationError(
            f"kinematics is none, so that every axis must show itself, but no usable sweep shows that of joint "
            f"{', '.join(map(str, missing))}: sweep it with its own and all earlier joints recorded, or name the robot"
            + "".join(f"\n{line}" for line in told)
        )
    known = np.where(record.joints_known, record.joints, np.nan)
    ranges = np.column_stack([np.nanmin(known, axis=0), np.nanmax(known, axis=0)])
    shown: Extraction = arm_without_drawing(
        record.robot, f"axes of {record.name}", surest, ranges, Tolerances(UNDRAWN_LENGTH_M, UNDRAWN_ANGLE_RAD)
    )
    return _Begun(shown.arm, False, sweeps, tracker_data(record, shown.arm), _findings(record, sweeps))


def _with_joint_noise(record: TrackerRecord, seen: TrackerData, at: Standing) -> Floats | None:
    """Stated noise of every point with what the joints' repeatability adds: a circle shows both."""
    if record.covariances is None:
        return None
    covariances = record.covariances.copy()
    state = _state(seen.data.arm, at)
    columns = Columns(head=False, reflectors=tuple("r" * len(at.reflectors_m)))
    for kind, rows in zip(seen.data.outside, seen.rows, strict=True):
        covariances[rows] += kind.linearised(state, columns).noises["joints"][:, :3, :3]
    return covariances


def _state(arm: Arm, at: Standing) -> JointState:
    return JointState(
        arm,
        reflectors_m=at.reflectors_m,
        Rs_link_reflector=at.Rs_link_reflector,
        Ts_base_instrument=at.Ts_base_instrument,
    )


def _findings(record: TrackerRecord, sweeps: tuple[JointSweep, ...]) -> tuple[RecordFinding, ...]:
    noise = [s.fit.noise_m for s in sweeps if s.fit is not None]
    found = [RecordFinding(s.name, f) for s in sweeps if not s.implied for f in s.findings]
    moved = tracker_findings(record, max(noise) if noise else None)
    return (*found, *(RecordFinding("record", f) for f in moved))


def _result(
    record: TrackerRecord,
    begun: _Begun,
    found: Estimate,
    verdicts: tuple[BlockVerdict, ...],
    versions: Mapping[str, str],
) -> TrackedArm:
    data, state = begun.seen.data, found.fit.state
    train = errors_at(found, found.fit)
    known = np.where(record.joints_known, record.joints, np.nan)
    home = np.nan_to_num(np.nanmedian(known, axis=0)) if len(record) else np.zeros(record.joints.shape[1])
    source = f"calibrated from {record.name}; nominal: {begun.nominal.source}"
    kept = [rows[good] for rows, good in zip(begun.seen.rows, found.kept, strict=True)]
    return TrackedArm(
        record=record.name,
        instrument=record.instrument,
        arm=replace(state.arm, source=source),
        nominal=begun.nominal,
        drawn=begun.drawn,
        T_base_tracker=state.Ts_base_instrument[0],
        sweeps=begun.sweeps,
        axes=tracked_axes(found, surest_sweeps(record, begun.sweeps), home),
        reflectors=reflector_places(record, begun.seen, found),
        joint=joint_evidence(begun.nominal, found, verdicts, (), data.stated),
        train=train,
        heldout=train,
        heldout_before=train,
        used=tuple(np.concatenate(kept).tolist()),
        rejections=wrong_points(record, begun.seen, found),
        findings=begun.findings,
        gates=(),
        inputs=dict(record.inputs),
        versions=dict(versions),
    )
