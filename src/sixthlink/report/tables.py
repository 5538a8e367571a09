"""Which rows of numbers does the page show, and how are they written?

Nouns become rows of text under heads that carry the unit; the template only decides where they stand.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sixthlink.calibrate import Calibration, CameraEvidence, ShotEvidence
from sixthlink.camera import LENS_NAMES, PINHOLE, PLAIN_TERMS, Camera, lens_vector
from sixthlink.measure import LengthCheck, statistics
from sixthlink.report.quantities import DASH, NOT_OBSERVED, fixed, millimetres, pixels, significant, with_std
from sixthlink.units import DEG, MM

__all__ = [
    "Table",
    "camera_table",
    "length_statistics_table",
    "length_table",
    "placement_table",
    "shot_table",
]


@dataclass(frozen=True)
class Table:
    """Rows of text under heads.

    Attributes:
        heads: Head of each column, its unit in it.
        rows: Cells.
        words: Number of leading columns that hold words; those between them and the tail hold numbers.
        marked: Rows that deserve the eye.
        soft: Rows that do not.
        tail: Number of last columns that hold pictures or words.
    """

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    marked: frozenset[int] = field(default_factory=frozenset)
    soft: frozenset[int] = field(default_factory=frozenset)
    tail: int = 0


def length_table(check: LengthCheck) -> Table:
    """Table II of the paper: length and signed error of every placement; the worst is marked.

    With the standard uncertainty of every length, and whether its 95 % interval holds the certified one, if known.
    """
    certified_m = check.standard.length_m
    sets = [check.after_m] if check.before_m is None else [check.before_m, check.after_m]
    rows = [
        (
            str(k + 1),
            name,
            *(cell for lengths_m in sets for cell in _length_cells(lengths_m[k], certified_m)),
            *_doubt(check, k),
        )
        for k, name in enumerate(check.placements)
    ]
    before = () if check.before_m is None else ("before [mm]", "error [mm]")
    doubt = () if check.std_m is None else ("± std [mm]", "in 95 %")
    heads = ("No.", "placement", *before, "after [mm]", "error [mm]", *doubt)
    worst = int(np.argmax(np.abs(check.after_m - certified_m)))
    return Table(heads, tuple(rows), words=2, marked=frozenset({worst}))


def length_statistics_table(check: LengthCheck) -> Table:
    """The five statistics of the errors, each named for what it is."""
    sets = [check.after_m] if check.before_m is None else [check.before_m, check.after_m]
    found = [statistics(lengths_m, check.standard.length_m) for lengths_m in sets]
    rows: tuple[tuple[str, ...], ...] = (
        ("mean error", *(millimetres(s.mean_m, sign=True) for s in found)),
        ("mean absolute error", *(millimetres(s.mean_abs_m) for s in found)),
        ("RMS error", *(millimetres(s.rms_m) for s in found)),
        ("standard deviation (n − 1)", *(millimetres(s.std_m) if s.count > 1 else DASH for s in found)),
        ("largest absolute error", *(millimetres(s.max_abs_m) for s in found)),
    )
    if check.inside_95 is not None:
        inside = f"{np.count_nonzero(check.inside_95)} of {len(check.after_m)}"
        rows += (("inside their 95 % interval", *([DASH] * (len(sets) - 1)), inside),)
    heads = (f"of {len(check.after_m)} signed errors", *(("before", "after")[-len(sets) :]))
    return Table(heads, rows, marked=frozenset({2}))


def shot_table(shots: Sequence[ShotEvidence], *, with_pixels: bool) -> Table:
    """Residuals of every shot; the worst of all is marked. ``with_pixels`` adds what the cameras saw."""
    turned = any(s.turns for s in shots)
    rows = []
    for s in shots:
        residual = (fixed(s.translation_m / MM, 4), fixed(s.rotation_rad / DEG, 4))
        seen = (fixed(s.rms_px, 3), str(s.points)) if with_pixels else ()
        remark = ("read from another end" if s.turns else "",) if turned else ()
        rows.append((s.shot, s.placement, *residual, *seen, *remark))
    pixel_heads = ("image RMS [px]", "points") if with_pixels else ()
    heads = (
        "shot",
        "placement",
        "residual [mm]",
        "residual [°]",
        *pixel_heads,
        *(("remark",) if turned else ()),
    )
    worst = max(range(len(shots)), key=lambda k: shots[k].translation_m, default=0)
    return Table(heads, tuple(rows), words=2, marked=frozenset({worst}))


def placement_table(calibration: Calibration) -> Table:
    """Where the target stood, how well that is known, and how well its shots agree about it."""
    rows = []
    joint = calibration.joint
    stds = np.zeros((len(calibration.placements), 6)) if joint is None else joint.placement_std
    Ts = calibration.Ts_base_target
    hidden = np.zeros(Ts.shape, dtype=bool) if calibration.unobserved is None else calibration.unobserved.targets
    for name, T, unseen, std in zip(calibration.placements, Ts, hidden, stds, strict=True):
        own = [s for s in calibration.shots if s.placement == name]
        place = (
            NOT_OBSERVED if u else with_std(float(v) / MM, float(s) / MM, "", 3)
            for v, u, s in zip(T[:3, 3], unseen[:3, 3], std[:3], strict=True)
        )
        doubt = () if joint is None else (", ".join(significant(float(s) / DEG, 2) for s in std[3:]),)
        shifts, turns = _rms([s.translation_m for s in own]) / MM, _rms([s.rotation_rad for s in own]) / DEG
        rows.append((name, str(len(own)), *place, *doubt, fixed(shifts, 4), fixed(turns, 4)))
    doubts = () if joint is None else ("± about x, y, z [°]",)
    heads = ("placement", "shots", "x [mm]", "y [mm]", "z [mm]", *doubts, "RMS [mm]", "RMS [°]")
    return Table(heads, tuple(rows))


def camera_table(calibration: Calibration) -> Table:
    """Intrinsics of every camera with their standard deviations; empty without cameras."""
    rig = calibration.rig
    if rig is None:
        return Table((), ())
    terms = _shown_terms(rig.cameras)
    columns = [_camera_column(c, e, terms) for c, e in zip(rig.cameras, calibration.cameras, strict=True)]
    whats = (
        "image",
        "lens model",
        "numbers",
        "fx",
        "fy",
        "cx",
        "cy",
        *(f"{LENS_NAMES[k]} [–]" for k in terms),
    )
    heads = ["", f"{rig.reference} (reference)" if len(rig.names) > 1 else rig.reference, *rig.names[1:]]
    return Table(tuple(heads), tuple(zip((*whats, "image RMS"), *columns, strict=True)))


def _length_cells(length_m: float, certified_m: float) -> tuple[str, str]:
    return fixed(length_m / MM, 4), fixed((length_m - certified_m) / MM, 4, sign=True)


def _doubt(check: LengthCheck, k: int) -> tuple[str, ...]:
    if check.std_m is None or check.inside_95 is None:
        return ()
    return fixed(float(check.std_m[k]) / MM, 4), "yes" if check.inside_95[k] else "no"


def _rms(values: Sequence[float]) -> float:
    """Root mean square; not a number where there is nothing, which is written as a dash."""
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan


def _shown_terms(cameras: Sequence[Camera]) -> list[int]:
    """Terms of distortion that the page shows, by their place in ``LENS_NAMES``: those that are usual or not zero."""
    used = np.any([c.distortion != 0.0 for c in cameras], axis=0)
    used[:PLAIN_TERMS] |= any(c.model == PINHOLE for c in cameras)
    return (4 + np.flatnonzero(used)).tolist()


def _camera_column(camera: Camera, evidence: CameraEvidence, terms: Sequence[int]) -> tuple[str, ...]:
    size = f"{camera.width_px} × {camera.height_px} px"
    origin = f"calibrated, {evidence.images} images" if evidence.calibrated else "given"
    cells = []
    values, rows = lens_vector(camera), [*range(4), *terms]
    for k, value, std in zip(rows, values[rows].tolist(), evidence.std[rows].tolist(), strict=True):
        held = " fixed" if evidence.calibrated and std == 0.0 else ""
        cells.append(with_std(float(value), float(std), *(("px", 3) if k < 4 else ("", 6))) + held)
    return (size, camera.model, origin, *cells, pixels(evidence.rms_px) if evidence.calibrated else DASH)
