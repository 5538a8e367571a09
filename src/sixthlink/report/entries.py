"""Which single values does the page name, and what does each of them mean?

The head in its spellings, the cameras among themselves, and what the search did. Every value is text with its
unit; the template only decides where it stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate import (
    Calibration,
    SearchReport,
    head_link_of,
    observed_positions,
    paper_numbers_of,
    unobserved_names,
    unobserved_of,
)
from sixthlink.geometry import Floats, motion_between
from sixthlink.recording import EYE_IN_HAND
from sixthlink.report.quantities import NOT_OBSERVED, degrees, fixed, millimetres, pixels, significant, with_std
from sixthlink.units import MM

__all__ = [
    "Entry",
    "board_entries",
    "camera_pair_entries",
    "fixed_head_entries",
    "head_link_entries",
    "head_shift",
    "matrix_text",
    "paper_entries",
    "search_entries",
    "unobserved_entries",
]


@dataclass(frozen=True)
class Entry:
    """One named value: symbol, value with unit, what it means, and the same value otherwise written."""

    symbol: str
    value: str
    meaning: str = ""
    aside: str = ""


def paper_entries(calibration: Calibration) -> tuple[tuple[Entry, ...], str]:
    """The paper's six numbers and their remark; empty for a fixed head."""
    numbers = paper_numbers_of(calibration)
    if numbers is None:
        return (), ""
    entries = {
        "alpha_rad": _angle("α", numbers.alpha_rad, "−α about X"),
        "beta_rad": _angle("β", numbers.beta_rad, "β about the new Y"),
        "gamma_rad": _angle("γ", numbers.gamma_rad, "γ about the new Z"),
        "x_m": Entry("x", millimetres(numbers.x_m), "camera origin at −x"),
        "y_m": Entry("y", millimetres(numbers.y_m), "camera origin at −y"),
        "z_m": Entry("z", millimetres(numbers.z_m), "camera origin at +z"),
    }
    return _observed(entries, unobserved_names(calibration, paper_numbers_of)), _remark(calibration, numbers.remark)


def head_link_entries(calibration: Calibration) -> tuple[tuple[Entry, ...], str]:
    """The head as sixth DH link and its remark; empty for a fixed head."""
    link = head_link_of(calibration)
    if link is None:
        return (), ""
    entries = {
        "theta6_rad": _angle("θ6", link.theta6_rad, "about Z5"),
        "d6_m": Entry("d6", millimetres(link.d6_m), "along Z5"),
        "a6_m": Entry("a6", millimetres(link.a6_m), "along X6, signed"),
        "alpha6_rad": _angle("α6", link.alpha6_rad, "about X6"),
        "phi_gamma_rad": _angle("φ+γ", link.phi_gamma_rad, "about Z6"),
        "L_m": Entry("L", millimetres(link.L_m), "camera origin at −L along Z6"),
    }
    return _observed(entries, unobserved_names(calibration, head_link_of)), _remark(calibration, link.remark)


def fixed_head_entries(calibration: Calibration) -> tuple[Entry, ...]:
    """Where a fixed head stands in the base frame and which way it looks."""
    x, y, z = calibration.X[:3, 3]
    look = ", ".join(fixed(float(v), 6) for v in calibration.X[:3, 2])
    tilt = math.acos(float(np.clip(-calibration.X[2, 2], -1.0, 1.0)))
    hidden = unobserved_of(calibration, lambda c: np.append(c.X[:3, 3], c.X[2, 2]))
    view_hidden = unobserved_of(calibration, lambda c: c.X[:3, 2]).any()
    entries = {
        "x": Entry("x", millimetres(float(x)), "camera origin along base X"),
        "y": Entry("y", millimetres(float(y)), "camera origin along base Y"),
        "z": Entry("z", millimetres(float(z)), "camera origin along base Z"),
        "view": Entry("view", f"({look})", "unit vector of the camera's z axis in the base frame"),
        "tilt": _angle("tilt", tilt, "between the view and straight down, base −Z"),
    }
    unseen = dict(zip(("x", "y", "z", "tilt"), hidden, strict=True)) | {"view": view_hidden}
    return _observed(entries, frozenset(name for name in unseen if unseen[name]))


def unobserved_entries(calibration: Calibration) -> tuple[Entry, ...]:
    """Along which axes the position was observed, where the whole head was not."""
    frame = "flange" if calibration.mount == EYE_IN_HAND else "base"
    return tuple(
        Entry("position", millimetres(position_m), f"along ({', '.join(fixed(v, 4) for v in axis)}) of the {frame}")
        for axis, position_m in observed_positions(calibration)
    )


def matrix_text(T: Floats, hidden: npt.NDArray[np.bool_]) -> str:
    """A transform as four lines that a program can read: rotation [-], translation in millimetres.

    Where ``hidden`` ``(4, 4)`` says so it says that the entry was not observed.
    """
    rows = T.copy()
    rows[:3, 3] /= MM
    rows = np.round(rows, 10) + 0.0  # no negative zero
    cells = [
        [NOT_OBSERVED if unseen else f"{v:{'14.6f' if k == 3 else '13.10f'}}" for k, (v, unseen) in enumerate(row)]
        for row in (zip(values, unseen, strict=True) for values, unseen in zip(rows, hidden, strict=True))
    ]
    return "\n".join("  ".join([*(f"{c:>13}" for c in row[:3]), f"{row[3]:>14}"]) for row in cells)


def head_shift(calibration: Calibration, nominal: Floats | None) -> str:
    """How far the calibrated head is from the drawing's, in words; empty without a drawing or the whole head."""
    if nominal is None or calibration.unobserved is not None:
        return ""
    motion = motion_between(nominal, calibration.X)
    shift, turn = float(np.linalg.norm(motion[:3])), float(np.linalg.norm(motion[3:]))
    return f"{millimetres(shift, 3)} and {degrees(turn)} from the drawing"


def camera_pair_entries(calibration: Calibration) -> tuple[Entry, ...]:
    """How the other cameras stand to the reference, and how well all agree."""
    rig = calibration.rig
    if rig is None or len(rig.names) < 2:
        return ()
    entries = []
    for name, T_camera_head in list(zip(rig.names, rig.Ts_camera_head, strict=True))[1:]:
        motion = motion_between(np.eye(4), T_camera_head)
        baseline, angle = float(np.linalg.norm(motion[:3])), float(np.linalg.norm(motion[3:]))
        entries.append(Entry("baseline", millimetres(baseline, 3), f"between {rig.reference} and {name}"))
        entries.append(Entry("angle", degrees(angle), f"between {rig.reference} and {name}"))
    if calibration.stereo_rms_px > 0.0:
        entries.append(Entry("stereo RMS", pixels(calibration.stereo_rms_px), "all cameras together"))
    return tuple(entries)


def board_entries(calibration: Calibration) -> tuple[Entry, ...]:
    """What the recording says of the target itself; empty where it says nothing."""
    board, entries = calibration.board, []
    if board.scale is not None and board.scale_std is not None:
        size = with_std(board.scale, board.scale_std, "", 5)
        entries.append(Entry("size", size, "times the declared one, by the robot's motion; the declared one is kept"))
    if board.sag_m:
        meaning = "found in the images and corrected"
        if board.moved_m is not None and board.moved_rad is not None:
            meaning += f"; taken as flat, the head would be {millimetres(board.moved_m, 3)} and "
            meaning += f"{degrees(board.moved_rad)} off"
        entries.append(Entry("bend", with_std(board.sag_m / MM, board.sag_std_m / MM, "mm", 3), meaning))
    if calibration.print_sigma_m:
        meaning = "one sigma per coordinate; found in the images and corrected"
        entries.append(Entry("misprints", millimetres(calibration.print_sigma_m), meaning))
    return tuple(entries)


def _proof(calibration: Calibration) -> tuple[str, str]:
    """Whether the answer is the proven minimum, and how close the bound is."""
    certificate = calibration.certificate
    verdict = "global minimum proven" if certificate.certified else "not proven"
    if calibration.unobserved is not None and certificate.certified:
        verdict = "global minimum proven, with what was not observed held"
    return verdict, f"relative gap to the lower bound {certificate.relative_gap:.1e}"


def search_entries(calibration: Calibration) -> tuple[Entry, ...]:
    """What eq. (11) was and how it was minimised."""
    value = f"{significant(calibration.value_m2 / MM**2, 6)} mm²"
    per_pair_m = math.sqrt(max(calibration.value_m2, 0.0) / max(calibration.pairs, 1))
    length = millimetres(calibration.rotation_length_m, 0)
    return (
        Entry("estimator", calibration.solver),
        Entry("eq. (11)", value, f"over {calibration.pairs} pairs of shots"),
        Entry("per pair", millimetres(per_pair_m), "root of eq. (11) per pair"),
        Entry("ℓ", length, "what one unit of a rotation entry counts in eq. (11)"),
        *_swarm_entries(calibration.search),
        Entry("proof", *_proof(calibration)),
    )


def _swarm_entries(search: SearchReport | None) -> tuple[Entry, ...]:
    """What the swarms did; nothing where none searched."""
    if search is None:
        return ()
    budget = search.budget
    before, after = (f"{significant(v / MM**2, 6)} mm²" for v in (search.best_unpolished_m2, search.value_m2))
    swarms = f"{budget.swarms} × {budget.particles} particles × {budget.iterations} iterations"
    box = f"±{millimetres(search.box.half_width_m, 1)}"
    return (
        Entry("swarms", swarms, f"variant {search.variant}, seed {search.seed}"),
        Entry("box", box, "for x, y, z; |α|, |γ| ≤ 180°, |β| ≤ 90°"),
        Entry("polish", f"{before} → {after}", "eq. (11) of the best swarm, before and after the polish"),
        Entry("agreement", f"{search.agreeing} of {budget.swarms} swarms", "ended at the same optimum"),
    )


def _angle(symbol: str, angle_rad: float, meaning: str) -> Entry:
    return Entry(symbol, degrees(angle_rad), meaning, f"{fixed(angle_rad, 6)} rad")


def _observed(entries: dict[str, Entry], hidden: frozenset[str]) -> tuple[Entry, ...]:
    """Entries by name, without a number where it was not observed."""
    return tuple(Entry(e.symbol, NOT_OBSERVED, e.meaning) if name in hidden else e for name, e in entries.items())


def _remark(calibration: Calibration, remark: str) -> str:
    """A remark on angles, where the orientation was observed."""
    return "" if calibration.unobserved is not None and calibration.unobserved.turns else remark
