"""What does a result say in a terminal, and as JSON?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from sixthlink.calibrate import (
    Calibration,
    SolverScore,
    head_link_of,
    observed_positions,
    paper_numbers_of,
    unobserved_names,
    unobserved_of,
)
from sixthlink.calibrate.touches import ArmCalibration
from sixthlink.cli.joint_summary import joint_lines
from sixthlink.cli.touch_summary import touch_summary
from sixthlink.files import arm_result_as_dict, result_as_dict
from sixthlink.geometry import Floats
from sixthlink.measure import LengthCheck, LengthStatistics, statistics
from sixthlink.robot import HeadLink, PaperNumbers
from sixthlink.units import DEG, MM

__all__ = [
    "calibration_as_dict",
    "calibration_summary",
    "check_as_dict",
    "check_summary",
    "comparison_as_dict",
    "comparison_summary",
]

NOT_OBSERVED = "not observed"
"""What is written instead of a number that the recording cannot know."""


def calibration_as_dict(calibration: Calibration | ArmCalibration) -> dict[str, Any]:
    """The JSON object of a calibration, as its result file has it."""
    if isinstance(calibration, ArmCalibration):
        return arm_result_as_dict(calibration)
    return result_as_dict(calibration)


def calibration_summary(calibration: Calibration | ArmCalibration, files: Mapping[str, str]) -> str:
    """A calibration in a dozen lines."""
    if isinstance(calibration, ArmCalibration):
        return touch_summary(calibration, files)
    scatter = calibration.scatter
    frame = "T_flange_camera" if calibration.T_link5_head is not None else "T_base_camera"
    lines = [
        f"{calibration.recording}: {'arm and head' if calibration.joint else 'head'} calibrated from "
        f"{len(calibration.shots)} shots, {len(calibration.placements)} placements, "
        + (f"{calibration.tracker_points} points of a laser tracker, " if calibration.tracker_points else "")
        + f"{len(calibration.rejections)} rejections",
        f"target scatter   {scatter.rms_translation_m / MM:.4f} mm RMS, {scatter.rms_rotation_rad / DEG:.4f}° RMS",
        f"{frame} [m]",
        *_matrix_lines(calibration),
        *_unobserved_lines(calibration),
        *_head_lines(calibration),
        *_print_lines(calibration),
        *joint_lines(calibration),
        *(f"note      {note}" for note in calibration.notes),
        *(f"rejected  {r.shot} {r.camera}: {r.reason}" for r in calibration.rejections),
        *(f"{'passed ' if g.passed else 'REFUSED'}  {g.name}: {g.message}" for g in calibration.gates),
        *(f"wrote {path}" for path in files.values()),
    ]
    return "\n".join(lines)


def check_summary(check: LengthCheck, files: Mapping[str, str]) -> str:
    """Table II: one row per placement, then the statistics, each named for what it is."""
    certified = check.standard.length_m
    after = check.after_m
    before = check.before_m
    lines = [
        f"length standard {certified / MM:.4f} mm, {len(after)} placements, lengths and errors in mm",
        f"{'placement':<12}{'before':>12}{'error':>10}{'after':>13}{'error':>10}{'± std':>10}  in 95 %",
    ]
    for k, name in enumerate(check.placements):
        lines.append(f"{name:<12}{_pair(before, k, certified)}{_pair(after, k, certified)}{_doubt(check, k)}")
    rows = _statistics(check)
    for label, field in _FIELDS.items():
        left = f"{getattr(rows['before'], field) / MM:>22.4f}" if rows["before"] else f"{'-':>22}"
        lines.append(f"{label:<12}{left}{getattr(rows['after'], field) / MM:>23.4f}")
    if before is None:
        lines.append("before: the recording names no nominal head (head.nominal), so there is nothing to compare with")
    lines += [f"rejected  {r.shot} {r.camera}: {r.reason}" for r in check.rejections]
    lines += [f"wrote {files['report']}"]
    return "\n".join(lines)


def check_as_dict(check: LengthCheck) -> dict[str, Any]:
    """The JSON object of a length check; lengths in metres."""
    certified = check.standard.length_m
    rows = _statistics(check)
    return {
        "standard": {"length_m": certified, "uncertainty_m": check.standard.uncertainty_m},
        "before": asdict(rows["before"]) if rows["before"] else None,
        "after": asdict(rows["after"]) if rows["after"] else None,
        "placements": [
            {
                "name": name,
                "before_m": None if check.before_m is None else float(check.before_m[k]),
                "before_error_m": None if check.before_m is None else float(check.before_m[k]) - certified,
                "after_m": float(check.after_m[k]),
                "after_error_m": float(check.after_m[k]) - certified,
                "std_m": None if check.std_m is None else float(check.std_m[k]),
                "inside_95": None if check.inside_95 is None else bool(check.inside_95[k]),
            }
            for k, name in enumerate(check.placements)
        ],
        "rejected": [asdict(r) for r in check.rejections],
    }


def comparison_summary(scores: Sequence[SolverScore]) -> str:
    """One row per solver, and whether the best is better by more than the noise."""
    lines = [
        f"{'solver':<22}{'scatter':>18}{'held-out shots':>18}{'held-out placements':>21}{'time':>11}  proof, eq. (11)",
        f"{'':<22}" + f"{'mm':>10}{'deg':>8}" * 2 + f"{'mm':>12}{'deg':>9}{'ms':>11}  with its own ℓ",
    ]
    for s in scores:
        if s.failure:
            lines.append(f"{s.name:<22}failed: {s.failure}")
            continue
        placement = (
            f"{s.placement_translation_m / MM:>12.4f}{s.placement_rotation_rad / DEG:>9.4f}"
            if s.placement_translation_m is not None and s.placement_rotation_rad is not None
            else f"{'-':>12}{'-':>9}"
        )
        proof = f"gap {s.certificate.relative_gap:.1e}, ℓ {s.rotation_length_m:.3g} m" if s.certificate else ""
        lines.append(
            f"{s.name:<22}{s.scatter_translation_m / MM:>10.4f}{s.scatter_rotation_rad / DEG:>8.4f}"
            f"{s.heldout_translation_m / MM:>10.4f}{s.heldout_rotation_rad / DEG:>8.4f}"
            f"{placement}{s.time_s * 1e3:>11.2f}  {proof}"
        )
    note = "all take the arm as exact; sixthlink calibrate estimates it too: judge that with --holdout"
    return "\n".join([*lines, _verdict(scores), note])


def comparison_as_dict(scores: Sequence[SolverScore]) -> dict[str, Any]:
    """The JSON object of a comparison; metres, radians, seconds."""
    hidden = {"heldout_translations_m", "heldout_rotations_rad", "certificate"}
    rows = []
    for s in scores:
        row = {k: v for k, v in vars(s).items() if k not in hidden}
        row["certified"] = s.certificate.certified if s.certificate else False
        row["relative_gap"] = s.certificate.relative_gap if s.certificate else None
        rows.append(row)
    return {"solvers": rows, "verdict": _verdict(scores)}


def _verdict(scores: Sequence[SolverScore]) -> str:
    """The best on held-out shots, in position and in orientation, beside how much of its lead is noise."""
    positions = {s.name: s.heldout_translations_m / MM for s in scores if s.heldout_translations_m is not None}
    turns = {s.name: s.heldout_rotations_rad / DEG for s in scores if s.heldout_rotations_rad is not None}
    if len(positions) < 2:
        return "fewer than two solvers answered: nothing to compare"
    return f"{_best('position', positions, ' mm')}\n{_best('orientation', turns, '°')}"


def _best(what: str, errors: Mapping[str, Floats], unit: str) -> str:
    """The lowest mean held-out error, and which others it beats by more than twice the noise, paired over shots."""
    best, *others = sorted(errors, key=lambda name: float(errors[name].mean()))
    clear = []
    for other in others:
        difference = errors[other] - errors[best]
        noise = float(difference.std(ddof=1)) / len(difference) ** 0.5
        if difference.mean() > 2.0 * noise > 0.0:
            clear.append(f"{other} by {difference.mean():.4f} ± {noise:.4f}{unit}")
    if not clear:
        return f"held-out {what}: lowest for {best}, but no solver is worse by more than the noise"
    return f"held-out {what}: lowest for {best}; beyond twice the noise it is better than " + ", ".join(clear)


_FIELDS = {
    "mean": "mean_m",
    "mean abs": "mean_abs_m",
    "RMS": "rms_m",
    "std (n-1)": "std_m",
    "max abs": "max_abs_m",
}


def _statistics(check: LengthCheck) -> dict[str, LengthStatistics | None]:
    certified = check.standard.length_m
    return {
        "before": None if check.before_m is None else statistics(check.before_m, certified),
        "after": statistics(check.after_m, certified),
    }


def _pair(lengths: Floats | None, k: int, certified: float) -> str:
    if lengths is None:
        return f"{'-':>13}{'-':>10}"
    return f"{lengths[k] / MM:>13.4f}{(lengths[k] - certified) / MM:>10.4f}"


def _doubt(check: LengthCheck, k: int) -> str:
    if check.std_m is None or check.inside_95 is None:
        return f"{'-':>10}"
    return f"{check.std_m[k] / MM:>10.4f}  {'yes' if check.inside_95[k] else 'NO'}"


def _print_lines(calibration: Calibration) -> list[str]:
    lines, board = [], calibration.board
    if calibration.print_sigma_m:
        lines.append(
            f"target           its points are misprinted by {calibration.print_sigma_m / MM:.4f} mm (one sigma, "
            "per coordinate); found in the pixels and corrected"
        )
    if board.sag_m:
        lines.append(
            f"target           bent by {board.sag_m / MM:.3f} ± {board.sag_std_m / MM:.3f} mm; found in the pixels and "
            "corrected"
            + (
                f"; taken as flat, the head would be {board.moved_m / MM:.3f} mm and {board.moved_rad / DEG:.4f}° off"
                if board.moved_m is not None and board.moved_rad is not None
                else ""
            )
        )
    return lines


def _head_lines(calibration: Calibration) -> list[str]:
    numbers, link = paper_numbers_of(calibration), head_link_of(calibration)
    if numbers is None or link is None:
        return ["a fixed head is no link of the arm: it has no six numbers and no DH form"]
    behind = "link 5" if calibration.arm is not None else "the flange (the recording has no kinematics)"
    hidden = unobserved_names(calibration, paper_numbers_of) | unobserved_names(calibration, head_link_of)

    def written(name: str, value: float, unit: float, decimals: int) -> str:
        return NOT_OBSERVED if name in hidden else f"{value / unit:.{decimals}f}"

    angles = {name: written(name, value, 1.0, 6) for name, value in _ending(numbers, link, "_rad").items()}
    lengths = {name: written(name, value, MM, 4) for name, value in _ending(numbers, link, "_m").items()}
    lines = [
        f"the paper's six numbers, against {behind}",
        f"   α {angles['alpha_rad']}  β {angles['beta_rad']}  γ {angles['gamma_rad']} rad   "
        f"x {lengths['x_m']}  y {lengths['y_m']}  z {lengths['z_m']} mm",
        "DH sixth link",
        f"   θ6 {angles['theta6_rad']} rad  d6 {lengths['d6_m']} mm  a6 {lengths['a6_m']} mm  "
        f"α6 {angles['alpha6_rad']} rad  φ+γ {angles['phi_gamma_rad']} rad  L {lengths['L_m']} mm",
    ]
    if calibration.unobserved is not None and calibration.unobserved.turns:
        return lines
    return lines + [f"   {remark}" for remark in (numbers.remark, link.remark) if remark]


def _ending(numbers: PaperNumbers, link: HeadLink, unit: str) -> dict[str, float]:
    """Numbers of one unit by name."""
    return {name: value for name, value in (vars(numbers) | vars(link)).items() if name.endswith(unit)}


def _matrix_lines(calibration: Calibration) -> list[str]:
    hidden = unobserved_of(calibration, lambda c: c.X)
    return [
        "   " + "  ".join(NOT_OBSERVED if unseen else f"{v: .9f}" for v, unseen in zip(row, row_hidden, strict=True))
        for row, row_hidden in zip(calibration.X, hidden, strict=True)
    ]


def _unobserved_lines(calibration: Calibration) -> list[str]:
    """What was not observed, in words, and along which axes the position was."""
    if calibration.unobserved is None:
        return []
    lines = [f"NOT OBSERVED  {words}" for words in calibration.unobserved.words]
    for axis, position_m in observed_positions(calibration):
        along = ", ".join(f"{v + 0.0:.4f}" for v in axis.round(4))  # no negative zero
        lines.append(f"observed      position {position_m / MM:.4f} mm along ({along})")
    return lines
