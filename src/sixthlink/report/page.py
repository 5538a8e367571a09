"""How does a calibration explain itself on one page?

The page is one file that asks nobody for anything: style, drawings and small images are inside, there are no
scripts, and a content security policy forbids the rest. Every string that came from a file is escaped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from sixthlink.calibrate import Calibration, ShotEvidence, unobserved_of
from sixthlink.geometry import Floats
from sixthlink.measure import LengthCheck, LengthStatistics, statistics
from sixthlink.progress import Progress, Silent
from sixthlink.recording import EYE_IN_HAND, Detections, Recording
from sixthlink.report.entries import (
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
from sixthlink.report.overlays import ImageReader, ShotPictures, shot_pictures
from sixthlink.report.quantities import DASH, degrees, fixed, millimetres, pixels
from sixthlink.report.scene import cell_of, cell_plot
from sixthlink.report.tables import (
    camera_table,
    length_statistics_table,
    length_table,
    placement_table,
    shot_table,
)

if TYPE_CHECKING:
    from jinja2 import Template

__all__ = ["report_page"]

ZOOM_WORTH_SAYING = 1.2
"""Ratio of the largest errors from which the caption says that the second plot has another scale."""


@dataclass(frozen=True)
class Verdict:
    """The first thing a reader sees.

    Attributes:
        accepted: Whether no gate refuses.
        words: By which gates, in words.
        figure: The headline number with its unit.
        was: The same before calibration; empty when unknown.
        meaning: What the number is.
    """

    accepted: bool
    words: str
    figure: str
    was: str
    meaning: str


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
    return _template().render(
        calibration=calibration,
        recording=recording,
        foreign=recording.name != calibration.recording,
        created=created,
        verdict=_verdict(calibration, judged),
        facts=_facts(calibration, judged),
        head=_head(calibration, recording),
        ruler=_ruler(judged) if judged else None,
        ruler_unmeasured=check is not None and judged is None,
        residuals=residual_plot(calibration.shots) if calibration.shots else None,
        shots=shot_table(calibration.shots, with_pixels=calibration.rig is not None),
        placements=placement_table(calibration),
        pictures=pictures,
        cameras=camera_table(calibration),
        camera_pairs=camera_pair_entries(calibration),
        cell=_cell(calibration, recording, shots, detections),
        rejections=(*calibration.rejections, *(check.rejections if check else ())),
        search=search_entries(calibration),
    )


def _template() -> Template:
    """The page's template; undefined names are errors, every value is escaped unless it is markup."""
    from importlib.resources import files

    from jinja2 import DictLoader, Environment, StrictUndefined

    here = files("sixthlink.report")
    names = ("page.html", "parts.html", "page.css")
    environment = Environment(
        loader=DictLoader({name: here.joinpath(name).read_text("utf-8") for name in names}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html")


def _shots_in(calibration: Calibration, recording: Recording) -> list[tuple[int, ShotEvidence]]:
    """Index in the recording and evidence of every used shot."""
    if recording.name != calibration.recording:
        return []
    index = {shot: k for k, shot in enumerate(recording.ids)}
    return [(index[s.shot], s) for s in calibration.shots if s.shot in index]


def _verdict(calibration: Calibration, check: LengthCheck | None) -> Verdict:
    refusing = [g for g in calibration.gates if not g.passed]
    if refusing:
        words = "Refused by " + ", ".join(f"“{g.name}”: {g.message}" for g in refusing) + "."
    elif calibration.gates:
        words = "Every gate passed: " + ", ".join(g.name for g in calibration.gates) + "."
    else:
        words = "No gate was set, so none refused."
    if check is None:
        meaning = "RMS scatter of the target’s position about its placement: agreement, not accuracy"
        rms = millimetres(calibration.scatter.rms_translation_m, 3) if calibration.shots else DASH
        return Verdict(calibration.accepted, words, rms, "", meaning)
    after, before = _errors(check)
    meaning = (
        f"RMS error of a certified length of {millimetres(check.standard.length_m)}, "
        f"measured at {_counted(after.count, 'placement')} that the calibration has not seen"
    )
    was = millimetres(before.rms_m, 3) if before else ""
    return Verdict(calibration.accepted, words, millimetres(after.rms_m, 3), was, meaning)


def _errors(check: LengthCheck) -> tuple[LengthStatistics, LengthStatistics | None]:
    certified = check.standard.length_m
    before = None if check.before_m is None else statistics(check.before_m, certified)
    return statistics(check.after_m, certified), before


def _facts(calibration: Calibration, check: LengthCheck | None) -> list[tuple[str, str]]:
    """A handful of figures under the verdict: what, how much."""
    placements = _counted(len(calibration.placements), "placement")
    facts = [("shots used", f"{len(calibration.shots)} at {placements}")]
    if calibration.shots:
        scatter = calibration.scatter
        facts.append(
            (
                "target scatter, RMS",
                f"{millimetres(scatter.rms_translation_m)}, {degrees(scatter.rms_rotation_rad)}",
            )
        )
    if check is not None:
        facts.append(("largest length error", millimetres(_errors(check)[0].max_abs_m)))
    if calibration.rig is not None and calibration.shots:
        rms_px = float(np.sqrt(np.mean([s.rms_px**2 for s in calibration.shots])))
        facts.append(("image residual, RMS", pixels(rms_px)))
    if calibration.search is not None:
        agreeing = f"{calibration.search.agreeing} of {calibration.search.budget.swarms} swarms"
        facts.append(("search agreement", agreeing))
    return [*facts, ("not used", f"{len(calibration.rejections)} images or shots")]


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


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
    statistics_after, statistics_before = _errors(check)
    after = ErrorSeries("after", "after", check.after_m - certified_m)
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
    }
