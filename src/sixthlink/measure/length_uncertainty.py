"""How well is a measured length known?

Its derivative by every unknown of the calibration, with their joint covariance, plus what the measurement adds: pixels
and joint repeatability at both ends (GUM, law of propagation; docs/theory/uncertainty.md).
"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate import Calibration, MarkPoint
from sixthlink.calibrate.arm import BLOCKS, link_parameters, optional_parameters
from sixthlink.calibrate.joint import repeatability_of
from sixthlink.calibrate.observations import Columns, JointState, KnownLengths
from sixthlink.camera import RigUnknowns, unknowns_named
from sixthlink.geometry import Floats
from sixthlink.recording import EYE_TO_HAND, Recording, placement_indices
from sixthlink.target import LengthStandard

__all__ = ["length_stds", "uncertain_cameras"]


def uncertain_cameras(calibration: Calibration) -> RigUnknowns | None:
    """What of the cameras the calibration knows only with an uncertainty; None where it keeps no covariance."""
    if calibration.joint is None or calibration.rig is None:
        return None
    names = tuple(n for n in calibration.joint.unknowns if n.split(".")[0] in calibration.rig.names)
    return unknowns_named(calibration.rig.names, names)


def length_stds(
    calibration: Calibration,
    recording: Recording,
    points: tuple[MarkPoint, ...],
    placements: tuple[str, ...],
    standard: LengthStandard,
) -> Floats | None:
    """Standard uncertainty ``(R,)`` of the length of each placement [m]; None where the calibration cannot tell.

    Args:
        calibration: A joint calibration; the head alone has no covariance.
        recording: The recording that the points were seen in.
        points: Marks in the head frame, with their derivative by :func:`uncertain_cameras`.
        placements: Names of the R placements that were measured.
        standard: The length standard.
    """
    joint, arm, unknowns = calibration.joint, calibration.arm, uncertain_cameras(calibration)
    if joint is None or arm is None or unknowns is None or recording.joints is None:
        return None
    used = [p for p in points if recording.placements[p.shot] in placements]
    shots = np.array([p.shot for p in used], dtype=np.int64)
    numbers, names = placement_indices(recording, shots)
    # The joints' size is a multiple of the pattern; the pixels' is in pixels, beside what the detector states.
    ratios = {n.origin: n.size if n.origin == "joints" else n.size / (n.stated or n.size) for n in joint.noise}
    seen = KnownLengths(
        joints=recording.joints[shots],
        points_head=np.array([p.point_head for p in used]),
        covariances=np.array([p.covariance for p in used]),
        lengths=numbers,
        ends=np.array([p.mark for p in used], dtype=np.int64),
        length_m=standard.length_m,
        uncertainty_m=standard.uncertainty_m,
        repeatability_rad=repeatability_of(arm),
        by_lens=np.array([p.by_rig for p in used]),
        fixed_head=recording.mount == EYE_TO_HAND,
    )
    known = {p.name: p for p in link_parameters(arm)}
    known |= {p.name: p for block in BLOCKS for p in optional_parameters(arm, block)}
    free = tuple(known[n.removeprefix("arm.")] for n in joint.unknowns if n.startswith("arm."))
    columns = Columns(lens=unknowns.size, arm=free)
    linear = seen.linearised(JointState(arm, X=calibration.X, lens_step=np.zeros(unknowns.size)), columns)
    gradient = linear.shared[:, 0]
    # Where a tracker's reflectors sit is estimated too, and no length hangs on it.
    measuring = [i for i, n in enumerate(joint.unknowns) if not n.startswith("reflector.")]
    covariance = joint.covariance[np.ix_(measuring, measuring)]
    variance = np.einsum("ri,ij,rj->r", gradient, covariance, gradient)
    for origin in ("joints", "pixels"):
        variance += linear.noises[origin][:, 0, 0] * ratios.get(origin, 1.0) ** 2
    order = [names.index(name) for name in placements]
    return np.asarray(np.sqrt(variance)[order], dtype=np.float64)
