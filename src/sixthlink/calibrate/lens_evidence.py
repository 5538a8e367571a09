"""How sure are the lenses?"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.calibration import CameraEvidence
from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, unseen_lens
from sixthlink.camera import RigUnknowns
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats

__all__ = ["camera_evidence", "lens_stds", "refuse_uncertain_focal"]

LARGEST_FOCAL_SHARE = 0.05
"""A focal length less certain than this share of itself is no result: the views hardly tilt, or show no perspective."""

TILTED_RAD = 0.2
"""Spread of the target's tilts that is enough for a lens, were the target large enough in the images."""


def camera_evidence(problem: RigProblem, fit: RigFit, calibrated: npt.NDArray[np.bool_]) -> tuple[CameraEvidence, ...]:
    """Views, residuals and standard deviations of each camera.

    Args:
        problem: Observations.
        fit: Their best explanation.
        calibrated: ``(C,)`` whether each camera's lens was free.
    """
    stds, evidence = lens_stds(problem.unknowns, fit.covariance), []
    for c in range(len(calibrated)):
        rows = problem.cameras == c
        rms = float(np.sqrt(np.mean(fit.residuals_px[rows] ** 2))) if rows.any() else 0.0
        evidence.append(CameraEvidence(bool(calibrated[c]), len(np.unique(problem.slots[rows])), rms, stds[c]))
    return tuple(evidence)


def refuse_uncertain_focal(problem: RigProblem, fit: RigFit) -> None:
    """Refuse lenses whose focal length the views do not tell.

    Raises:
        CalibrationError: A focal length is too uncertain.
    """
    for name, camera, std in zip(
        fit.rig.names, fit.rig.cameras, lens_stds(problem.unknowns, fit.covariance), strict=True
    ):
        if (std[:2] > LARGEST_FOCAL_SHARE * camera.focal_px).any():
            figure = f"focal length {camera.focal_px[0]:.0f} ± {std[0]:.0f} pixel"
            if _tilts_rad(fit) > TILTED_RAD:
                raise CalibrationError(
                    f"the views do not determine the intrinsics of camera {name!r} ({figure}): the target is too small "
                    "or too far away for its perspective to show; come closer, take a larger one, or give them"
                )
            raise CalibrationError(f"{unseen_lens(f' of camera {name!r}')} ({figure})")


def _tilts_rad(fit: RigFit) -> float:
    """How far the target's tilts are spread about their mean [rad]."""
    normals = fit.Ts_head_target[:, :3, 2]
    return float(np.sqrt(np.mean(np.sum((normals - normals.mean(axis=0)) ** 2, axis=1))))


def lens_stds(unknowns: RigUnknowns, covariance: Floats) -> Floats:
    """Standard deviations ``(C, 16)`` of the intrinsics from the covariance of all unknowns; 0 where none is free."""
    stds = np.zeros(unknowns.lens.shape)
    stds[unknowns.lens] = np.sqrt(np.diag(covariance))[: np.count_nonzero(unknowns.lens)]
    return stds
