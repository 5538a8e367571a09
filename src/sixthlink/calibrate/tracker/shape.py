"""Are there enough points, on enough of a circle that is large enough, to carry an axis?

Limits come from the noise wherever one can be had: a direction is seen when the points' extent along it stands out of
the noise, a radius is large enough when a whole turn with it would show the axis.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import fdtri

from sixthlink.calibrate.tracker.coaxial import nearest_circles, normal_covariance, start_circles, whitened
from sixthlink.calibrate.tracker.findings import CircleFinding, NoCircleError, degrees, millimetres, some
from sixthlink.calibrate.tracker.sweep import Sweep
from sixthlink.geometry import Floats
from sixthlink.units import DEG, MM

__all__ = ["judged_fit", "refuse_without_circle"]

SHORTEST_ARC_RAD = 30.0 * DEG
"""Shortest arc that is accepted. The axis' uncertainty grows with the square of what the arc falls short of a turn."""

USEFUL_RAD = 1e-3
"""Uncertainty of a direction beyond which it is of no use to a calibration: 1 mm at a metre."""

FEWEST_DOF = 4
"""Degrees of freedom of five points on one circle."""

NOISIEST_M = 1e-3
"""Scatter beyond which it is not a tracker's: then the points do not stand still, but are no sweep."""

CHANCE = 1e-4
"""Chance of an extent in the noise alone beyond which it is more than noise."""

MANY = 0.1
"""Share of points off the circle that are too many to be left out in silence."""


def refuse_without_circle(sweep: Sweep) -> None:
    """Refuse points that have no circle.

    Raises:
        NoCircleError: Too few, standing still, or on one line.
    """
    p = sweep.points_m
    N, M = len(p), len(np.unique(sweep.reflectors))
    if N < 3 or 2 * N - 4 - 2 * M < 1:
        raise NoCircleError([_too_few(sweep)])
    extents = _extents(sweep)
    if extents is None:
        return
    first, second, noise, limit = extents
    if noise > NOISIEST_M:
        return
    if first <= limit:
        raise NoCircleError([_still(sweep, first)])
    if second <= limit:
        bend = float(np.sqrt(max(second**2 - noise**2, 0.0)))
        uncertainty = min(noise / (bend * float(np.sqrt(N))) if bend > 10.0 * sweep.rounding_m else 10.0, 10.0)
        told = f"the axis' direction would be known to {_milliradians(uncertainty)}"
        words = (
            f"the {N} points lie on one line within {millimetres(second)}, over "
            f"{millimetres(np.ptp(p, axis=0).max())}: the arc is too short to bend out of the noise, the reflector "
            f"sits near the axis, or a sliding joint moved; {told}; sweep at least 30°, better 120°"
        )
        raise NoCircleError(
            [
                CircleFinding(
                    "collinear", words, {"points": float(N), "bend_m": second, "direction_uncertainty_rad": uncertainty}
                )
            ]
        )


def _extents(sweep: Sweep) -> tuple[float, float, float, float] | None:
    """RMS extents of the points along their first two directions, the noise, and what it may fake [m].

    The tenth of the points farthest from the middle is not asked: an outlier would be an extent. None where the third
    direction, the noise of an unstated sweep, has no freedom.
    """
    p = sweep.points_m
    far = np.linalg.norm(p - np.median(p, axis=0), axis=1)
    inner = np.argsort(far, kind="stable")[: max(len(p) - len(p) // 10, 4)]
    q, labels = p[inner], sweep.reflectors[inner]
    means = np.array(
        [q[labels == k].mean(axis=0) if (labels == k).any() else np.zeros(3) for k in range(len(sweep.names))]
    )
    dof = len(q) - len(np.unique(labels))
    if dof < 2:
        return None
    sizes = np.linalg.svd(q - means[labels], compute_uv=False) / np.sqrt(dof)
    if sweep.covariances_m2 is not None:
        noise = float(np.sqrt(np.trace(sweep.covariances_m2, axis1=1, axis2=2).mean() / 3.0))
        limit = noise * float(np.sqrt(fdtri(dof, 1e6, 1.0 - CHANCE)))
    else:
        noise = float(sizes[2])
        limit = noise * float(np.sqrt(fdtri(dof, max(dof - 2, 1), 1.0 - CHANCE)))
    return float(sizes[0]), float(sizes[1]), noise, limit + 10.0 * sweep.rounding_m


def _too_few(sweep: Sweep) -> CircleFinding:
    N = len(sweep.points_m)
    words = (
        f"{N} points always lie on some circle{_predicted(sweep)}; five are the least that check each other, measure "
        "ten or more on 120°"
    )
    return CircleFinding("too few points", words, {"points": float(N)})


def _still(sweep: Sweep, extent_m: float) -> CircleFinding:
    words = f"the {len(sweep.points_m)} points stand still within {millimetres(extent_m)}"
    moved = sweep.angles_rad is not None and float(np.ptp(sweep.angles_rad)) > 0.0
    if moved and sweep.angles_rad is not None:
        words += (
            f" while the joint column moves by {degrees(float(np.ptp(sweep.angles_rad)))}: the reflector sits on the "
            "axis, on a link before the joint, or the column is another joint's; mount it away from the axis"
        )
    else:
        words += ": the joint did not turn, or the reflector sits on its axis; mount it away from the axis and sweep"
    return CircleFinding("standing still", words, {"points": float(len(sweep.points_m)), "extent_m": extent_m})


def _predicted(sweep: Sweep) -> str:
    """How surely such points could tell the axis, as a clause; empty where they have no circle at all."""
    p = sweep.points_m
    if len(p) < 3 or np.linalg.svd(p - p.mean(axis=0), compute_uv=False)[1] <= 10.0 * sweep.rounding_m:
        return ""
    J = whitened(nearest_circles(start_circles(sweep), sweep, np.ones(len(p))), sweep)[2]
    uncertainty = float(np.sqrt(np.linalg.eigvalsh(normal_covariance(J)[2:4, 2:4])[-1]))
    if sweep.covariances_m2 is not None:
        return f" and would tell the axis' direction to {_milliradians(uncertainty)} only"
    return f" and each 0.01 mm of noise turns the axis by {_milliradians(0.01 * MM * uncertainty)}"


def _milliradians(angle_rad: float) -> str:
    if angle_rad >= 1.0:
        return "no better than 1 rad"
    return f"{angle_rad * 1e3:.2g} mrad" if angle_rad < 0.1 else f"{angle_rad * 1e3:.0f} mrad"


def judged_fit(
    sweep: Sweep,
    *,
    kept: npt.NDArray[np.bool_],
    deviations_m: Floats,
    arcs_rad: Floats,
    radii_m: Floats,
    noise_m: float,
    direction_uncertainty_rad: float,
    explained: bool,
) -> tuple[CircleFinding, ...]:
    """Findings about number, arc, radius and outliers.

    Args:
        sweep: The points.
        kept: ``(N,)`` whether each belongs.
        deviations_m: ``(N, 2)`` from their circles [m].
        arcs_rad: ``(M,)`` arc of each circle.
        radii_m: ``(M,)`` radius of each circle.
        noise_m: Noise that the deviations show.
        direction_uncertainty_rad: Standard uncertainty of the axis' direction.
        explained: Whether another finding already says why points are off.
    """
    found = []
    told = f"the axis' direction is known to {_milliradians(direction_uncertainty_rad)} (standard uncertainty)"
    figures = {"direction_uncertainty_rad": direction_uncertainty_rad}
    N = int(np.count_nonzero(kept))
    if 2 * N - 4 - 2 * len(radii_m) < FEWEST_DOF:
        words = f"{N} points on the circle hardly check each other, and {told}; measure ten or more on 120°"
        found.append(CircleFinding("too few points", words, {"points": float(N), **figures}))
    arc = float(arcs_rad.max())
    if arc < SHORTEST_ARC_RAD * (1.0 - 1e-9):
        words = f"the points cover {degrees(arc)} of the circle, and {told}; sweep at least 30°, better 120°"
        found.append(CircleFinding("short arc", words, {"arc_rad": arc, **figures}))
    if explained:
        return tuple(found)
    found += _near_axis(sweep, kept, radii_m, noise_m)
    if not kept.all():
        found.append(_outliers(kept, deviations_m, noise_m))
    return tuple(found)


def _near_axis(sweep: Sweep, kept: npt.NDArray[np.bool_], radii_m: Floats, noise_m: float) -> list[CircleFinding]:
    """Reflectors whose circle is so small that even a whole turn would not show the axis (C13)."""
    counts = np.bincount(sweep.reflectors[kept], minlength=len(radii_m))
    whole_turn_rad = np.sqrt(2.0 / np.maximum(counts, 1)) * noise_m / np.maximum(radii_m, 1e-300)
    near = whole_turn_rad > USEFUL_RAD
    if near.any() and noise_m > NOISIEST_M:
        words = (
            f"the points leave the circle by {millimetres(noise_m)} RMS in no order, on a radius of "
            f"{millimetres(radii_m.max())}: several joints moved, or this is no sweep; sweep one joint alone"
        )
        return [CircleFinding("no circle", words, {"noise_m": noise_m, "radius_m": float(radii_m.max())})]
    return [
        CircleFinding(
            "near the axis",
            f"{sweep.names[k]} turns on a radius of {millimetres(radii_m[k])}, {radii_m[k] / noise_m:.3g} times the "
            f"noise of {millimetres(noise_m)}: even a whole turn would show the direction to "
            f"{_milliradians(float(whole_turn_rad[k]))} only; mount it farther from the axis",
            {"radius_m": float(radii_m[k]), "noise_m": noise_m, "whole_turn_rad": float(whole_turn_rad[k])},
            bool(near.all()),
        )
        for k in np.flatnonzero(near).tolist()
    ]


def _outliers(kept: npt.NDArray[np.bool_], deviations_m: Floats, noise_m: float) -> CircleFinding:
    off = np.flatnonzero(~kept)
    distances = np.linalg.norm(deviations_m[off], axis=1)
    share = len(off) / len(kept)
    named = some(off.tolist(), [millimetres(d) for d in distances.tolist()])
    figures = {"points": float(len(off)), "largest_m": float(distances.max()), "share": share}
    off_words = f"{named} off the circle of the others, whose noise is {millimetres(noise_m)}"
    if share < MANY:
        words = f"{off_words}: left out; look whether the beam was broken or the joint still moved"
        return CircleFinding("outliers", words, figures, grave=False)
    words = f"{off_words}: {100.0 * share:.0f} % of the points are too many to leave out; measure the sweep again"
    return CircleFinding("outliers", words, figures)
