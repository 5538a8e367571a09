"""What does a joint estimate say in a terminal?"""

from __future__ import annotations

from sixthlink.calibrate import ArmEvidence, Budget, Calibration, HeldOut, JointEvidence
from sixthlink.units import DEG, MM

__all__ = ["arm_lines", "joint_lines", "noise_line"]

NONE_SEEN = 1e-3
"""Multiple of what was stated below which an origin of noise was not seen at all."""

CORRELATIONS = 5
"""Correlated pairs that are listed; the result file has all of them."""


def joint_lines(calibration: Calibration) -> list[str]:
    """Arm, noise, budget and held-out error; nothing for the head alone."""
    lines: list[str] = []
    if calibration.joint is not None:
        joint = calibration.joint
        lines += _uncertainty(joint)
        lines += arm_lines(joint.arm)
        lines += [
            f"block {b.block:<11}{'entered' if b.entered else 'left out'}: held-out shots gain {b.gain:.3f} ± "
            f"{b.standard_error:.3f} in -2 log likelihood each"
            for b in joint.blocks
        ]
        lines += [
            f"hardly told apart: {c.first} and {c.second} (correlation {c.coefficient:+.3f})"
            for c in joint.correlations[:CORRELATIONS]
        ]
        if len(joint.correlations) > CORRELATIONS:
            lines.append(f"   and {len(joint.correlations) - CORRELATIONS} more pairs above 0.9, in result.json")
        lines += _budget(joint.budget)
    return lines + _heldout(calibration.heldout)


def _uncertainty(joint: JointEvidence) -> list[str]:
    std = joint.head_std
    position = "  ".join(f"{std[f'{axis}_m'] / MM:.4f}" for axis in "xyz")
    turn = "  ".join(f"{std[f'rotation_{axis}_rad'] / DEG:.5f}" for axis in "xyz")
    return [f"head, standard deviation   x y z {position} mm   about x y z {turn}°", noise_line(joint)]


def noise_line(joint: JointEvidence) -> str:
    """How far the stated noise explains the data, and how large it is."""
    noise = ", ".join(f"{n.origin} {_size(n.size, n.unit)}" for n in joint.noise)
    return f"χ² per degree of freedom {joint.chi2_per_dof:.3f} ({joint.dof} degrees); noise: {noise}"


def arm_lines(parameters: tuple[ArmEvidence, ...]) -> list[str]:
    """Every parameter of the arm, nominal and calibrated."""
    lines = [f"{'arm':<18}{'nominal':>14}{'calibrated':>14}{'± std':>10}"]
    for p in parameters:
        unit, scale = _display(p.unit)
        if p.free:
            numbers = f"{p.nominal / scale:>14.4f}{p.value / scale:>14.4f}{p.std / scale:>10.4f}"
            lines.append(f"   {p.name:<15}{numbers} {unit}{f'   {p.reason}' if p.reason else ''}")
        else:
            lines.append(f"   {p.name:<15}{p.nominal / scale:>14.4f}{'nominal':>14}{'':>10} {unit}   {p.reason}")
    return lines


def _budget(budget: Budget | None) -> list[str]:
    if budget is None:
        return []
    parts = {
        "pixels": budget.pixels_m,
        "lens": budget.lens_m,
        "head": budget.head_m,
        "arm": budget.arm_m,
        "repeatability": budget.repeatability_m,
    }
    listed = ", ".join(f"{name} {value / MM:.4f}" for name, value in parts.items())
    return [
        f"a length of {budget.reference_length_m / MM:.0f} mm is measured to ± {budget.std_m / MM:.4f} mm (one "
        f"standard deviation); in it, mm: {listed}; the target's own errors are not stated",
        f"advice: {budget.advice}",
    ]


def _heldout(heldout: HeldOut | None) -> list[str]:
    if heldout is None:
        return []
    return [
        f"held-out error   {heldout.rms_translation_m / MM:.4f} mm RMS, {heldout.rms_rotation_rad / DEG:.4f}° RMS on "
        f"{heldout.shots} shots that were kept out of the fit"
    ]


def _display(unit: str) -> tuple[str, float]:
    return {"m": ("mm", MM), "rad": ("°", DEG), "rad/m": ("°/m", DEG)}.get(unit, (unit, 1.0))


def _size(size: float, unit: str) -> str:
    shown, scale = _display(unit)
    if shown == "-" and size < NONE_SEEN:
        return "none seen"
    return f"{size / scale:.3g} × stated" if shown == "-" else f"{size / scale:.3g} {shown}"
