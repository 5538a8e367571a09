"""Where does the uncertainty of a measured length come from, and what would help most?

Reference lengths lie between the target's middles of shots of different placements, each end seen from its own pose
as a user would measure. Their variance is split: what the measurement itself adds (pixels, repeatability), and what
the calibration leaves. The calibration's part is taken apart in the order lens, arm geometry, head: by how much it
falls when each is known exactly, given those before it; so the parts add up and none is negative.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sixthlink.calibrate.joint import Budget, Estimate, JointData, repeatability_of
from sixthlink.calibrate.observations import Columns, KnownLengths, Linearised
from sixthlink.geometry import Floats

__all__ = ["budget_of", "calibration_parts"]

LENGTHS = 200
"""Reference lengths at most."""

SHORTEST_M = 0.05

SAME_MODE = 0.9
"""Correlation from which the weakest direction counts as a change of scale."""


def budget_of(data: JointData, found: Estimate, middle_m: Floats) -> Budget | None:
    """Error budget of lengths between placements, or None with a single placement.

    Args:
        data: What was observed.
        found: The estimate.
        middle_m: ``(3,)`` middle of the target in its own frame [m].
    """
    reference = _reference(data, found, middle_m)
    if reference is None:
        return None
    linear = reference.linearised(found.fit.state, found.problem.columns)
    lengths_m = linear.residuals[:, 0] + reference.length_m
    far = lengths_m > SHORTEST_M
    if not far.any():
        return None
    parts = calibration_parts(linear, found.covariance, found.problem.columns)
    parts |= {
        "pixels": linear.noises["pixels"][:, 0, 0] * found.scales["pixels"] ** 2,
        "repeatability": linear.noises["joints"][:, 0, 0] * found.scales["joints"] ** 2,
    }
    means = {name: float(np.mean(values[far])) for name, values in parts.items()}
    advice = _advice(means, linear.shared[far, 0], found.covariance, lengths_m[far])
    return Budget(
        reference_length_m=float(np.mean(lengths_m[far])),
        std_m=float(np.sqrt(sum(means.values()))),
        pixels_m=float(np.sqrt(means["pixels"])),
        lens_m=float(np.sqrt(means["lens"])),
        target_m=None,
        head_m=float(np.sqrt(means["head"])),
        arm_m=float(np.sqrt(means["arm"])),
        repeatability_m=float(np.sqrt(means["repeatability"])),
        advice=advice,
    )


def calibration_parts(linear: Linearised, covariance: Floats, columns: Columns) -> dict[str, Floats]:
    """Variance ``(R,)`` of lengths that lens, arm geometry and head leave, in that order [m²]."""
    G = linear.shared[:, 0]
    left = covariance
    parts = {}
    for name, at in (("lens", columns.lens_slice), ("arm", columns.arm_slice)):
        known = _given(left, at)
        parts[name] = np.maximum(np.einsum("ri,ij,rj->r", G, left - known, G), 0.0)
        left = known
    parts["head"] = np.maximum(np.einsum("ri,ij,rj->r", G, left, G), 0.0)
    return parts


def _given(covariance: Floats, at: slice) -> Floats:
    """Covariance when the unknowns of a slice are known exactly."""
    if at.stop == at.start:
        return covariance
    cross = covariance[:, at]
    return np.asarray(covariance - cross @ np.linalg.pinv(covariance[at, at], rcond=1e-13, hermitian=True) @ cross.T)


def _reference(data: JointData, found: Estimate, middle_m: Floats) -> KnownLengths | None:
    """Virtual marks at the target's middle of kept shots, paired across placements."""
    shots = data.shots
    if shots is None:
        return None
    kept, placements = found.kept[0], shots.problem.placements
    i, j = np.nonzero(np.triu(placements[:, None] != placements[None, :]) & kept[:, None] & kept[None, :])
    if len(i) == 0:
        return None
    chosen = np.linspace(0, len(i) - 1, min(len(i), LENGTHS)).round().astype(np.int64)
    ends = np.concatenate([i[chosen], j[chosen]])
    Ts = shots.problem.Ts_inner[ends]
    covariances = np.zeros((len(ends), 3, 3)) if shots.covariances is None else shots.covariances[ends, :3, :3]
    number = np.tile(np.arange(len(chosen)), 2)
    return KnownLengths(
        joints=shots.joints[ends],
        points_head=Ts[:, :3, :3] @ middle_m + Ts[:, :3, 3],
        covariances=covariances,
        lengths=number,
        ends=np.repeat([0, 1], len(chosen)),
        length_m=1.0,
        uncertainty_m=0.0,
        repeatability_rad=repeatability_of(data.arm),
        by_lens=shots.by_lens[ends, :3] if found.problem.columns.lens else np.zeros((0, 3, 0)),
        fixed_head=shots.fixed_head,
    )


def _advice(means: Mapping[str, float], gradients: Floats, covariance: Floats, lengths_m: Floats) -> str:
    calibration = means["lens"] + means["arm"] + means["head"]
    if calibration <= means["pixels"] + means["repeatability"]:
        if means["repeatability"] >= means["pixels"]:
            return "the robot's repeatability rules: measure each point from several poses and take the mean"
        return "the pixels rule: come closer with the head, or see each point in more images"
    errors = np.linalg.svd(gradients @ np.linalg.cholesky(covariance + 1e-30 * np.eye(len(covariance))))[0][:, 0]
    alike = abs(float(errors @ lengths_m)) / float(np.linalg.norm(errors) * np.linalg.norm(lengths_m))
    if alike > SAME_MODE:
        return "overall scale is the weak direction: add three placements of a length standard (kind scale)"
    if means["lens"] > 0.5 * calibration:
        return "the lens rules: add shots that fill the image corners and tilt the target"
    return (
        "the arm's geometry rules: add placements far from those recorded, and shots with other elbow and wrist angles"
    )
