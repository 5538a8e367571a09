"""Which rows of numbers prove a joint estimate: the arm, the noise, the optional blocks, what is hardly told apart?"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from sixthlink.calibrate import ArmEvidence, BlockVerdict, JointEvidence, NoiseEvidence
from sixthlink.calibrate.arm import BLOCKS, link_parameters, optional_parameters
from sixthlink.calibrate.joint import repeatability_of
from sixthlink.measure import COVERAGE_95
from sixthlink.report.joint_figures import IntervalScale
from sixthlink.report.quantities import DASH, SPACE, fixed, significant, with_std
from sixthlink.report.svg import element
from sixthlink.report.tables import Table
from sixthlink.robot import Arm
from sixthlink.units import DEG, MM

__all__ = [
    "arm_table",
    "block_table",
    "correlation_table",
    "head_std_table",
    "noise_table",
    "tolerances_in_words",
]

NOT_STATED = "not stated"
_ORIGINS = {
    "joints": "joint repeatability",
    "pixels": "pixels",
    "standard": "length standard",
    "contact": "touched points",
    "across": "recorded poses, across the view",
    "along": "recorded poses, along the view",
    "tilt": "recorded poses, tilt",
    "roll": "recorded poses, turn about the view",
    "instrument": "tracker’s points",
    "readings": "tracker’s points",
    "probe": "probe’s orientation",
    "orientation": "probe’s orientation",
}
_SOURCES = {
    "pixels": "by the images’ own residuals",
    "standard": "by its certificate",
    "instrument": "by the record",
    "probe": "by the record",
}
_BLOCKS = {
    "coupling": "joint couplings",
    "scale": "joint scales",
    "harmonics": "periodic joint errors",
    "compliance": "joints that yield to gravity",
}


def arm_table(arm: Arm, evidence: tuple[ArmEvidence, ...]) -> Table:
    """Every parameter of the arm in the order of its chain; what stayed nominal is soft and says why."""
    sigmas = _tolerances(arm)
    changes = {p.name: (p.value - p.nominal) / sigmas[p.name] for p in evidence if p.free and p.name in sigmas}
    doubts = {p.name: p.std / sigmas[p.name] for p in evidence if p.name in changes}
    reach = max((abs(c) + COVERAGE_95 * doubts[name] for name, c in changes.items()), default=1.0)
    scale = IntervalScale(max(reach, 1.2), 1.0)
    rows = []
    for p in evidence:
        picture = scale.cell(changes[p.name], doubts[p.name], _in_words(p)) if p.name in changes else Markup("")
        shown = element("div", picture, element("span", p.reason), class_="pictured") if p.reason else picture
        rows.append((p.name, _written(p.nominal, p.unit), *_found(p), shown))
    soft = frozenset(k for k, p in enumerate(evidence) if not p.free)
    heads = ("parameter", "nominal", "calibrated", "change / std", scale.head())
    return Table(heads, tuple(rows), soft=soft, tail=1)


def tolerances_in_words(arm: Arm, evidence: tuple[ArmEvidence, ...]) -> str:
    """What the maker states of lengths and angles, and what was assumed."""
    sigmas = {p.unit: p.sigma for p in link_parameters(arm)}
    stated = {"m": arm.length_tolerance_m, "rad": arm.angle_tolerance_rad}
    words = [f"{_written(sigma, unit)}{'' if stated[unit] else ' (assumed)'}" for unit, sigma in sigmas.items()]
    optional = {p.name for p in evidence} - {p.name for p in link_parameters(arm)}
    return " and ".join(f"±{SPACE}{w}" for w in words) + ("; assumed for optional parameters" if optional else "")


def head_std_table(joint: JointEvidence) -> Table:
    """Standard deviations of the head's position and turn, by axis; empty where no head was estimated."""
    std = joint.head_std
    if len(std) < 6:
        return Table((), ())
    shifts = (f"{significant(std[f'{axis}_m'] / MM, 2)}{SPACE}mm" for axis in "xyz")
    turns = (f"{significant(std[f'rotation_{axis}_rad'] / DEG, 2)}°" for axis in "xyz")
    return Table(("standard deviation", "x", "y", "z"), (("position along", *shifts), ("turn about", *turns)))


def noise_table(arm: Arm, noise: tuple[NoiseEvidence, ...]) -> Table:
    """Size of every origin of noise, beside what was stated beforehand."""
    rows = tuple((_ORIGINS.get(n.origin, n.origin), *_size(arm, n)) for n in noise)
    return Table(("origin", "size", "stated beforehand"), rows)


def block_table(blocks: tuple[BlockVerdict, ...]) -> Table:
    """Optional blocks: what held-out observations gain by each, and whether it entered; what entered is marked."""
    reach = max((abs(b.gain) + COVERAGE_95 * b.standard_error for b in blocks), default=1.0)
    scale = IntervalScale(max(1.1 * reach, 1e-6))
    rows = []
    for b in blocks:
        gain = f"{fixed(b.gain, 3, sign=True)} ±{SPACE}{fixed(b.standard_error, 3)}"
        name = _BLOCKS.get(b.block, b.block)
        picture = scale.cell(b.gain, b.standard_error, f"{name}: {gain}")
        rows.append((name, gain, picture, "entered" if b.entered else "left out"))
    marked = frozenset(k for k, b in enumerate(blocks) if b.entered)
    return Table(("block", "gain ± std", scale.head(), "verdict"), tuple(rows), marked=marked, tail=2)


def correlation_table(joint: JointEvidence) -> Table:
    """Pairs of unknowns that the data hardly tell apart, the closest first."""
    rows = tuple((c.first, c.second, fixed(c.coefficient, 3, sign=True)) for c in joint.correlations)
    return Table(("one", "other", "correlation"), rows, words=2)


def _tolerances(arm: Arm) -> Mapping[str, float]:
    """What each parameter could be off by before anything was measured, by name [its unit]."""
    optional = (p for block in BLOCKS for p in optional_parameters(arm, block))
    return {p.name: p.sigma for p in (*link_parameters(arm), *optional)}


def _found(p: ArmEvidence) -> tuple[str, str]:
    """Calibrated value ± its standard deviation, and the change in standard deviations."""
    if not p.free:
        return "nominal", ""
    in_stds = fixed((p.value - p.nominal) / p.std, 1, sign=True) if p.std > 0.0 else DASH
    return _written(p.value, p.unit, p.std), in_stds


def _in_words(p: ArmEvidence) -> str:
    return f"{p.name}: change {_written(p.value - p.nominal, p.unit, p.std)}"


def _written(value: float, unit: str, std: float = 0.0) -> str:
    """A value for people; without a deviation in as many digits as it has."""
    shown, scale = {"m": (f"{SPACE}mm", MM), "rad": ("°", DEG), "rad/m": ("°/m", DEG)}.get(unit, ("", 1.0))
    if std > 0.0:
        return with_std(value / scale, std / scale, "", 4) + shown
    digits = fixed(value / scale, 4)
    return (digits.rstrip("0").rstrip(".") if "." in digits else digits) + shown


def _size(arm: Arm, n: NoiseEvidence) -> tuple[str, str]:
    """Size as used and as stated, with units where they are known."""
    if n.unit == "m":
        return _length(n.size), NOT_STATED if n.stated is None else _length(n.stated)
    if n.unit == "rad":
        return _angle(n.size), NOT_STATED if n.stated is None else _angle(n.stated)
    if n.unit == "px":
        return _pixels(n.size), NOT_STATED if n.stated is None else f"{_pixels(n.stated)} by the detector"
    ratio = f"{fixed(n.size, 2)}{SPACE}× stated"
    if n.origin != "joints":
        return ratio, _SOURCES.get(n.origin, "")
    unit = float(repeatability_of(arm)[0])
    turning = bool(arm.turns[np.any(arm.joint_map != 0.0, axis=1)].all())
    size = _angle(n.size * unit) if turning else ""
    if n.stated is None:
        return size or f"{significant(n.size * unit, 3)} rad or m", NOT_STATED
    stated = _angle(n.stated * unit) + " " if turning else ""
    return f"{size}, {ratio}" if size else ratio, f"{stated}by the robot’s file"


def _pixels(size_px: float) -> str:
    return f"{fixed(size_px, 4)}{SPACE}px"


def _angle(angle_rad: float) -> str:
    return f"{significant(angle_rad / DEG, 3)}°"


def _length(length_m: float) -> str:
    return f"{significant(length_m / MM, 3)}{SPACE}mm"
