"""How do touches of a recording become an arm?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sixthlink.calibrate.gates import noise_gate, used_gate
from sixthlink.calibrate.joint import (
    Estimate,
    Fit,
    JointData,
    JointEvidence,
    NoiseEvidence,
    estimate,
    joint_evidence,
    start_of,
)
from sixthlink.calibrate.observations import Columns, JointState
from sixthlink.calibrate.touches.arm_calibration import ArmCalibration, FixedPoint, HeldOutTouches, TouchEvidence
from sixthlink.calibrate.touches.pose_errors import PARTS
from sixthlink.calibrate.touches.settle import SettledTouches, settled_touches
from sixthlink.calibrate.touches.sockets import Touches, touch_data
from sixthlink.errors import CalibrationError, TooFewShotsError
from sixthlink.geometry import Floats, transform_points
from sixthlink.progress import Progress
from sixthlink.recording import Recording, Rejection, shots_of_kind
from sixthlink.robot import Arm, flange_poses
from sixthlink.solvers import Reduced
from sixthlink.units import MM

__all__ = ["calibrate_arm", "touches_of", "wrong_touches"]

STAGE = "arm from touches"

FEWEST_DEGREES = 12
"""Numbers that the touches must say beyond their own unknowns (tool and sockets): below, nothing of an arm is seen."""

FITS_ANOTHER = 0.2
"""A wrong touch belongs to another socket when it is off from that one by less than this share."""


def touches_of(recording: Recording, kind: str) -> Touches:
    """Touches of one kind of a recording."""
    if recording.joints is None or recording.arm is None:
        raise CalibrationError("touches need joint values and the robot's kinematics")
    shots = shots_of_kind(recording, kind)
    names = ([column[i] for i in shots] for column in (recording.ids, recording.placements, recording.marks))
    ids, placements, marks = map(tuple, names)
    return Touches(ids, placements, marks, recording.joints[shots], recording.standard)


def calibrate_arm(
    recording: Recording,
    progress: Progress,
    *,
    noise: str = "estimated",
    versions: Mapping[str, str] | None = None,
) -> ArmCalibration:
    """Calibrate the arm of a recording of touches.

    Args:
        recording: What was recorded.
        progress: Listener.
        noise: Joint repeatability in the verdict on single touches: ``estimated``, or ``stated`` by the arm's file.
        versions: Versions of the software, for the record.

    Raises:
        TooFewShotsError: The touches say hardly more than where tool and sockets are.
        CalibrationError: There are no joint values, or the estimate does not settle.
    """
    touches = touches_of(recording, "calibrate")
    nominal = recording.arm
    assert nominal is not None  # noqa: S101 - touches_of made sure
    _check_enough(touches)
    progress.step(STAGE, 0, 2)
    data = touch_data(nominal, touches)
    found = estimate(data, noise=noise)
    progress.step(STAGE, 1, 2)
    settled = settled_touches(data, found)
    progress.step(STAGE, 2, 2)
    evidence = _evidence(nominal, data, found, settled)
    before = _distances(data, start_of(data)[0])
    after = _distances(data, settled.state)
    kept = found.kept[0]
    heldout, unjudged = _held_out(touches, touches_of(recording, "judge"), settled)
    tool_m = settled.state.tool_m
    assert tool_m is not None  # noqa: S101 - touches have a tool
    return ArmCalibration(
        recording=recording.name,
        arm=replace(settled.state.arm, source=f"calibrated from {recording.name}; nominal: {nominal.source}"),
        nominal=nominal,
        tool_m=tool_m,
        standard=recording.standard if data.distances is not None else None,
        points=_points(touches, settled.state),
        touches=tuple(
            TouchEvidence(shot, place, mark, q, float(b), float(a))
            for shot, place, mark, q, b, a, good in zip(
                touches.shots, touches.placements, touches.marks, touches.joints, before, after, kept, strict=True
            )
            if good
        ),
        smoothness_rad=settled.smoothness_rad,
        joint=evidence,
        rejections=(*wrong_touches(touches, found.kept[0], settled.state), *unjudged),
        gates=(used_gate(len(kept), int(kept.sum())), noise_gate(evidence)),
        heldout=heldout,
        inputs=dict(recording.inputs),
        versions=dict(versions or {}),
    )


def wrong_touches(
    touches: Touches, kept: np.ndarray[tuple[int], np.dtype[np.bool_]], state: JointState
) -> tuple[Rejection, ...]:
    """A rejection with its reason for every touch that the estimate left out."""
    places, points = touches.numbers()
    balls = _balls(touches.joints, state)
    touched = {*touches.sockets}
    rejections = []
    for i in np.flatnonzero(~kept).tolist():
        off = np.linalg.norm(balls[i] - state.points_m[places[i]], axis=1)
        own = float(off[points[i]])
        reason = f"{own / MM:.3g} mm off what the other touches of socket {touches.marks[i]!r} say"
        others = [
            (float(off[k]), name)
            for k, name in enumerate(touches.points)
            if name != touches.marks[i] and (touches.placements[i], name) in touched
        ]
        if others and min(others)[0] < FITS_ANOTHER * own:
            reason += f": it fits socket {min(others)[1]!r} of the same place; correct its mark"
        else:
            reason += "; was the ball seated, and did the arm stand still when the joints were read?"
        rejections.append(Rejection(touches.shots[i], "", reason))
    return tuple(rejections)


def _check_enough(touches: Touches) -> None:
    N, sockets = len(touches.shots), len(touches.sockets)
    needed = -(-(FEWEST_DEGREES + 3 + 3 * sockets) // 3)
    if needed > N:
        raise TooFewShotsError(
            f"{N} calibrate touches of {sockets} socket{'s' if sockets != 1 else ''} say hardly more than where ball "
            f"and sockets are; at least {needed} are needed, 30 per socket in poses as different as can be are good",
            needed=needed,
            usable=N,
        )


def _evidence(nominal: Arm, data: JointData, found: Estimate, settled: SettledTouches) -> JointEvidence:
    """The shared evidence, with the covariance that correlated errors leave."""
    root = np.linalg.inv(np.linalg.cholesky(settled.shared_covariance))
    G = settled.columns.size
    shared = np.zeros((G + 1, G + 1))
    shared[:G, :G] = root
    fit = Fit(settled.state, found.fit.linear, Reduced(shared, ()), (), found.fit.cost, found.fit.iterations)
    evidence = joint_evidence(nominal, replace(found, fit=fit), (), (), data.stated)
    sizes = np.sqrt(settled.fit.variances).tolist()
    noise = tuple(
        NoiseEvidence(name, "m" if name == "contact" else "-", size, data.stated.get(name))
        for name, size in zip(PARTS, sizes, strict=True)
    )
    known = tuple(n for n in evidence.noise if n.origin not in PARTS)
    return replace(evidence, noise=(*noise, *known))


def _balls(joints: Floats, state: JointState) -> Floats:
    """Where the ball's centre is ``(N, 3)`` in the base frame [m]."""
    assert state.tool_m is not None  # noqa: S101
    return transform_points(flange_poses(state.arm, joints), np.tile(state.tool_m, (len(joints), 1)))


def _distances(data: JointData, state: JointState) -> Floats:
    """Distance ``(N,)`` of the ball to its socket [m]."""
    assert data.touches is not None  # noqa: S101
    residuals = data.touches.linearised(state, Columns(head=False, tool=True)).residuals
    return np.asarray(np.linalg.norm(residuals, axis=1), dtype=np.float64)


def _points(touches: Touches, state: JointState) -> tuple[FixedPoint, ...]:
    found = []
    for place, mark in touches.sockets:
        x, y, z = state.points_m[touches.places.index(place), touches.points.index(mark)].tolist()
        found.append(FixedPoint(place, mark, (x, y, z)))
    return tuple(found)


def _held_out(
    touches: Touches, judges: Touches, settled: SettledTouches
) -> tuple[HeldOutTouches | None, tuple[Rejection, ...]]:
    """Error on the touches of kind ``judge``; those of sockets that the calibration does not know are named."""
    known = np.array([s in touches.sockets for s in zip(judges.placements, judges.marks, strict=True)], dtype=bool)
    rejections = tuple(
        Rejection(shot, "", f"nothing to judge it by: no calibrate touch of {mark!r} at {place!r}")
        for shot, place, mark, good in zip(judges.shots, judges.placements, judges.marks, known, strict=True)
        if not good
    )
    if not known.any():
        return None, rejections
    at = [
        settled.state.points_m[touches.places.index(place), touches.points.index(mark)]
        for place, mark, good in zip(judges.placements, judges.marks, known, strict=True)
        if good
    ]
    off = _balls(judges.joints[known], settled.state) - np.array(at)
    return HeldOutTouches(int(known.sum()), float(np.sqrt(np.mean(np.sum(off**2, axis=1))))), rejections
