"""How does a calibration explain itself on one page?

The page is one file that asks nobody for anything: style, drawings and small images are inside, there are no
scripts, and a content security policy forbids the rest. Every string that came from a file is escaped.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup

from sixthlink.calibrate import Calibration, ShotEvidence, unobserved_of
from sixthlink.geometry import Floats
from sixthlink.measure import COVERAGE_95, LengthCheck
from sixthlink.progress import Progress, Silent
from sixthlink.recording import EYE_IN_HAND, Detections, Recording
from sixthlink.report.entries import (
    board_entries,
    camera_pair_entries,
    fixed_head_entries,
    head_link_entries,
    head_shift,
    matrix_text,
    paper_entries,
    search_entries,
    unobserved_entries,
)
from sixthlink.report.figures import ErrorSeries, error_plot, residual_plot
from sixthlink.report.joint_figures import budget_plot
from sixthlink.report.joint_tables import (
    arm_table,
    block_table,
    correlation_table,
    head_std_table,
    noise_table,
    tolerances_in_words,
)
from sixthlink.report.overlays import ImageReader, ShotPictures, shot_pictures
from sixthlink.report.quantities import fixed, millimetres
from sixthlink.report.scene import cell_of, cell_plot
from sixthlink.report.tables import (
    camera_table,
    length_statistics_table,
    length_table,
    placement_table,
    shot_table,
)
from sixthlink.report.templates import template
from sixthlink.report.verdict import check_statistics, facts_of, verdict_of

__all__ = ["report_page"]

ZOOM_WORTH_SAYING = 1.2
"""Ratio of the largest errors from which the caption says that the second plot has another scale."""


def report_page(
    calibration: Calibration,
    *,
    recording: Recording,
    detections: Detections | None = None,
    read_image: ImageReader | None = None,
    check: LengthCheck | None = None,
    created: str = "",
    progress: Progress | None = None,
) -> str:
    """A calibration as one self-contained HTML page.

    Args:
        calibration: What to explain.
        recording: The recording that ``detections`` and ``read_image`` index. When it is not the one that was
            calibrated (a verification elsewhere), its shots are not drawn.
        detections: Points that were found; marks of the length standard among them are drawn into the cell.
        read_image: Gives the grey image of a shot and a camera, both by index.
        check: The length standard, measured before and after.
        created: When the page was made, for people.
        progress: Listener.

    Returns:
        The page, to be written as UTF-8.
    """
    judged = check if check is not None and len(check.after_m) else None
    shots = _shots_in(calibration, recording)
    pictures: tuple[ShotPictures, ...] = ()
    if detections is not None and calibration.rig is not None:
        pictures = shot_pictures(recording, detections, shots, read_image, progress or Silent())
    return template("page.html", "joint.html").render(
        calibration=calibration,
        recording=recording,
        foreign=recording.name != calibration.recording,
        created=created,
        verdict=verdict_of(calibration, judged),
        facts=facts_of(calibration, judged),
        head=_head(calibration, recording),
        joint=_joint(calibration),
        ruler=_ruler(judged) if judged else None,
        ruler_unmeasured=check is not None and judged is None,
        residuals=residual_plot(calibration.shots) if calibration.shots else None,
        shots=shot_table(calibration.shots, with_pixels=calibration.rig is not None),
        placements=placement_table(calibration),
        pictures=pictures,
        cameras=camera_table(calibration),
        camera_pairs=camera_pair_entries(calibration),
        board=board_entries(calibration),
        cell=_cell(calibration, recording, shots, detections),
        rejections=(*calibration.rejections, *(check.rejections if check else ())),
        search=search_entries(calibration),
    )


def _shots_in(calibration: Calibration, recording: Recording) -> list[tuple[int, ShotEvidence]]:
    """Index in the recording and evidence of every used shot."""
    if recording.name != calibration.recording:
        return []
    index = {shot: k for k, shot in enumerate(recording.ids)}
    return [(index[s.shot], s) for s in calibration.shots if s.shot in index]


def _head(calibration: Calibration, recording: Recording) -> dict[str, Any]:
    """The head as numbers, as link and as matrix."""
    moving = calibration.mount == EYE_IN_HAND
    paper, paper_remark = paper_entries(calibration)
    link, link_remark = head_link_entries(calibration)
    T_link5_head = calibration.T_link5_head if calibration.arm is not None else None
    return {
        "moving": moving,
        "paper": paper,
        "link": link,
        "remarks": [r for r in (paper_remark, link_remark) if r],
        "fixed": () if moving else fixed_head_entries(calibration),
        "frame": "T_flange_head" if moving else "T_base_head",
        "matrix": matrix_text(calibration.X, unobserved_of(calibration, lambda c: c.X)),
        "link5": "" if T_link5_head is None else _link5_text(calibration, T_link5_head),
        "across": unobserved_entries(calibration),
        "shift": head_shift(calibration, recording.head.nominal),
    }


def _joint(calibration: Calibration) -> dict[str, Any] | None:
    """What a joint estimate adds: budget, arm, noise, optional blocks and correlations; None for the head alone."""
    joint, arm = calibration.joint, calibration.arm
    if joint is None or arm is None:
        return None
    return {
        "budget": joint.budget,
        "budget_length": millimetres(joint.budget.reference_length_m, 0) if joint.budget else "",
        "budget_plot": budget_plot(joint.budget) if joint.budget else None,
        "arm": arm_table(arm, joint.arm),
        "free": sum(p.free for p in joint.arm),
        "tolerances": tolerances_in_words(arm, joint.arm),
        "head_std": head_std_table(joint),
        "noise": noise_table(arm, joint.noise),
        "blocks": block_table(joint.blocks),
        "correlations": correlation_table(joint),
    }


def _link5_text(calibration: Calibration, T_link5_head: Floats) -> str:
    return matrix_text(T_link5_head, unobserved_of(calibration, lambda c: np.asarray(c.T_link5_head)))


def _cell(
    calibration: Calibration,
    recording: Recording,
    shots: list[tuple[int, ShotEvidence]],
    detections: Detections | None,
) -> Markup | None:
    """The cell, where every place in it was observed."""
    if not shots or calibration.unobserved is not None:
        return None
    return cell_plot(cell_of(calibration, recording, shots, detections))


def _ruler(check: LengthCheck) -> dict[str, Any]:
    """The length standard: certificate, Table II, statistics and the plots."""
    certified_m, band_m = check.standard.length_m, 2.0 * check.standard.uncertainty_m
    statistics_after, statistics_before = check_statistics(check)
    halves_m = None if check.std_m is None else COVERAGE_95 * np.hypot(check.std_m, check.standard.uncertainty_m)
    after = ErrorSeries("after", "after", check.after_m - certified_m, halves_m)
    plots: list[tuple[str, Markup]] = []
    zoomed = "Errors after"
    if check.before_m is not None and statistics_before is not None:
        series = (ErrorSeries("before", "before", check.before_m - certified_m), after)
        label = "Errors before and after on one scale"
        plots.append((label, error_plot(check.placements, series, band_m=band_m, label=label)))
        if statistics_after.max_abs_m > 0.0:
            zoom = statistics_before.max_abs_m / statistics_after.max_abs_m
            zoomed += f", scale enlarged {fixed(zoom, 1)} times" if zoom > ZOOM_WORTH_SAYING else ""
    plots.append((zoomed, error_plot(check.placements, [after], band_m=band_m, label=zoomed)))
    return {
        "standard": f"{millimetres(certified_m)} ± {millimetres(check.standard.uncertainty_m)}",
        "table": length_table(check),
        "statistics": length_statistics_table(check),
        "plots": plots,
        "before": check.before_m is not None,
        "intervals": check.std_m is not None,
    }
