"""What does the calibration of an arm from a tracker record say in a terminal?"""

from __future__ import annotations

from collections.abc import Mapping

from sixthlink.calibrate.tracked_arm import TrackedArm
from sixthlink.cli.joint_summary import arm_lines, noise_line
from sixthlink.units import DEG, MM

__all__ = ["tracked_arm_summary"]

CIRCLES = 12
"""Circles that are listed; the result file has all of them."""

REJECTIONS = 20


def tracked_arm_summary(c: TrackedArm, files: Mapping[str, str]) -> str:
    """Circles, axes, arm, held-out error, and what was not used."""
    lines = [
        f"{c.record}: arm calibrated from {len(c.used)} points of {c.instrument}, {len(c.sweeps)} sweeps, "
        f"{len(c.rejections)} points left out",
        f"held-out error   {c.heldout_before.rms_m / MM:.4f} mm RMS nominal, {c.heldout.rms_m / MM:.4f} mm calibrated, "
        f"{c.heldout.max_m / MM:.4f} mm at most, at points predicted by fits that had not seen their pose",
    ]
    if c.heldout.rms_rad is not None:
        lines.append(f"held-out turn    {c.heldout.rms_rad / DEG:.4f}° RMS")
    lines += [noise_line(c.joint), *_circles(c), *_axes(c)]
    lines += [
        f"coupling {p.name.removeprefix('coupling_')}   {p.value:.6f} ± {p.std:.6f} (nominal {p.nominal:g})"
        if p.free
        else f"coupling {p.name.removeprefix('coupling_')}   {p.nominal:g}, nominal: {p.reason}"
        for p in c.couplings
    ]
    lines += [
        f"reflector {r.name:<9} {'  '.join(f'{v / MM:.4f}' for v in r.place_m.tolist())} mm on link {r.link}"
        + (f"; not seen {r.unseen}" if r.unseen else "")
        for r in c.reflectors
    ]
    lines += arm_lines(c.joint.arm)
    lines += [
        f"block {b.block:<11}{'entered' if b.entered else 'left out'}: held-out points gain {b.gain:.3f} ± "
        f"{b.standard_error:.3f} in -2 log likelihood each"
        for b in c.joint.blocks
    ]
    lines += [f"{'FOUND  ' if f.finding.grave else 'note   '}  {f.where}: {f.finding}" for f in c.findings]
    lines += [f"rejected  {r.shot}: {r.reason}" for r in c.rejections[:REJECTIONS]]
    if len(c.rejections) > REJECTIONS:
        lines.append(f"   and {len(c.rejections) - REJECTIONS} more points, in result.json")
    lines += [f"{'passed ' if g.passed else 'REFUSED'}  {g.name}: {g.message}" for g in c.gates]
    return "\n".join([*lines, *(f"wrote {path}" for path in files.values())])


def _circles(c: TrackedArm) -> list[str]:
    shown = [s for s in c.sweeps if s.fit is not None]
    if not shown:
        return []
    lines = [f"{'circles':<26}{'points':>8}{'radius':>12}{'arc':>8}{'radial':>10}{'plane':>10}"]
    for s in shown[:CIRCLES]:
        if s.fit is None:
            continue
        kept = f"{int(s.fit.kept.sum())}/{len(s.fit.kept)}"
        radius = f"{float(s.fit.circles[0].radius_m) / MM:.3f}"
        arc = f"{float(s.fit.arcs_rad.max()) / DEG:.0f}°"
        lines.append(
            f"   {s.name:<23.23}{kept:>8}{radius:>12}{arc:>8}{s.fit.radial_rms_m / MM:>10.4f}"
            f"{s.fit.plane_rms_m / MM:>10.4f} mm"
        )
    if len(shown) > CIRCLES:
        lines.append(f"   and {len(shown) - CIRCLES} more sweeps, in result.json")
    return lines


def _axes(c: TrackedArm) -> list[str]:
    lines = [f"{'axes in the tracker frame':<26}{'direction':>30}{'± mrad':>10}{'± mm':>10}"]
    for a in c.axes:
        direction = "  ".join(f"{v:+.6f}" for v in a.axis.direction.tolist())
        lines.append(f"   {a.joint:<17}{direction:>36}{a.direction_std_rad * 1e3:>10.4f}{a.position_std_m / MM:>10.4f}")
    return lines
