"""What does the calibration of a head's cameras leave behind?"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sixthlink.calibrate.board_shape import BoardShape
from sixthlink.calibrate.calibration import CameraEvidence
from sixthlink.calibrate.lens_choice import LensVerdict
from sixthlink.camera import CameraRig, RigUnknowns
from sixthlink.geometry import Floats
from sixthlink.recording import Detections, Rejection

__all__ = ["RigCalibration"]


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """The cameras of the head, and the evidence for them.

    Attributes:
        rig: The head.
        cameras: Evidence per camera; the RMS is that of its views in the common refinement, given lens or not.
        stereo_rms_px: RMS residual per coordinate over the shots that more than one camera saw [pixel]; 0 with
            one camera.
        noise_px: Standard deviation of a pixel coordinate, as the residuals show it [pixel].
        stated_px: The same, as the detector states it [pixel].
        noise_ratio: ``noise_px`` over the deviations in ``detections`` [-].
        detections: The detections without refused views, a symmetric target named alike by all cameras of a shot,
            ellipses' middles corrected to those of discs, and in the deviations what the residuals leave unexplained.
        rejections: Views and shots that were refused, and why.
        unknowns: The G free parameters.
        covariance: ``(G, G)`` of these [pixel, -, m, rad].
        points_m: ``(P, 3)`` points of the target, misprints corrected where the images show them [m].
        print_sigma_m: Standard deviation of a misprint, per coordinate [m]; 0 where none shows.
        shape: How the target is bent, corrected in ``points_m``; None where the images show no bend.
        models: Richer lens models that were tried, and whether they entered.
    """

    rig: CameraRig
    cameras: tuple[CameraEvidence, ...]
    stereo_rms_px: float
    noise_px: float
    stated_px: float
    noise_ratio: float
    detections: Detections
    rejections: tuple[Rejection, ...]
    unknowns: RigUnknowns
    covariance: Floats
    points_m: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    print_sigma_m: float = 0.0
    shape: BoardShape | None = None
    models: tuple[LensVerdict, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters, for example ``right.fx`` and ``left.rotation_z``."""
        return self.unknowns.names(self.rig.names)
