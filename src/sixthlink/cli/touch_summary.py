"""What does the calibration of an arm from touches say in a terminal?"""

from __future__ import annotations

from collections.abc import Mapping

from sixthlink.calibrate.touches import ArmCalibration
from sixthlink.cli.joint_summary import arm_lines, noise_line
from sixthlink.units import MM

__all__ = ["touch_summary"]


def touch_summary(c: ArmCalibration, files: Mapping[str, str]) -> str:
    """An arm, what it rests on, and what was not used."""
    x, y, z = c.tool_m / MM
    lines = [
        f"{c.recording}: arm calibrated from {len(c.touches)} touches of {len(c.points)} sockets, "
        f"{len(c.rejections)} rejections",
        f"ball to its socket   {c.rms_before_m / MM:.4f} mm RMS nominal, {c.rms_after_m / MM:.4f} mm calibrated",
        f"ball in the flange's frame   {x:.4f}  {y:.4f}  {z:.4f} mm",
        noise_line(c.joint),
        *arm_lines(c.joint.arm),
    ]
    if c.standard is None:
        lines.append("no certified distance was touched: the scale is the nominal arm's")
    if c.heldout is not None:
        lines.append(f"held-out error   {c.heldout.rms_translation_m / MM:.4f} mm RMS on {c.heldout.shots} touches")
    lines += [f"rejected  {r.shot}: {r.reason}" for r in c.rejections]
    lines += [f"{'passed ' if g.passed else 'REFUSED'}  {g.name}: {g.message}" for g in c.gates]
    return "\n".join([*lines, *(f"wrote {path}" for path in files.values())])
