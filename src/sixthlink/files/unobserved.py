"""How does a result say that something was not observed?

A number that depends on what the motion did not show is ``null``. What is needed to measure with the rest is kept
beside it: the unseen motions, and the position along the axes on which it was observed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from sixthlink.calibrate import Calibration, Unobserved, observed_positions, unobserved_names, unobserved_of
from sixthlink.geometry import Floats
from sixthlink.robot import HeadLink, PaperNumbers

__all__ = [
    "filled",
    "head_matrix",
    "head_numbers",
    "held_head",
    "motions_as_dict",
    "target_matrices",
    "unobserved_from_dict",
]


def head_matrix(c: Calibration, matrix_of: Callable[[Calibration], Floats | None]) -> list[list[float | None]] | None:
    """A matrix of the head, null where it was not observed; None where there is none."""
    T = matrix_of(c)
    if T is None:
        return None
    hidden = unobserved_of(c, lambda of: np.asarray(matrix_of(of)))
    return np.where(hidden, None, T.astype(object)).tolist()  # type: ignore[call-overload]


def head_numbers(
    c: Calibration, numbers_of: Callable[[Calibration], HeadLink | PaperNumbers | None]
) -> dict[str, Any] | None:
    """Numbers of the head by name, null where they were not observed."""
    numbers, hidden = numbers_of(c), unobserved_names(c, numbers_of)
    if numbers is None:
        return None
    # A remark speaks of angles.
    silent = {"remark": ""} if c.unobserved is not None and c.unobserved.turns else {}
    return asdict(numbers) | dict.fromkeys(sorted(hidden)) | silent


def motions_as_dict(c: Calibration, unobserved: Unobserved) -> dict[str, Any]:
    """The unseen motions and the observed components of the position; lengths in metres."""
    return {
        "motions": unobserved.motions.tolist(),
        "tolerance": unobserved.tolerance,
        "observed_position": [{"axis": a.tolist(), "position_m": p} for a, p in observed_positions(c)],
    }


def target_matrices(c: Calibration) -> list[Any]:
    """Target poses of the placements, null where they were not observed."""
    hidden = False if c.unobserved is None else c.unobserved.targets
    return np.where(hidden, None, c.Ts_base_target.astype(object)).tolist()  # type: ignore[call-overload]


def held_head(data: Mapping[str, Any], name: str) -> Floats:
    """The head ``(4, 4)``, its position made of the components that were observed, the others held at zero."""
    X = filled(data["head"][name])
    found = data.get("unobserved_motions")
    if found:
        X[:3, 3] = sum((np.array(p["axis"]) * p["position_m"] for p in found["observed_position"]), np.zeros(3))
    return X


def filled(rows: Any) -> Floats:
    """Numbers with zeros for what was not observed."""
    cells = np.array(rows, dtype=object)
    return np.where(cells == None, 0.0, cells).astype(np.float64)  # noqa: E711 - cell by cell


def unobserved_from_dict(data: Mapping[str, Any], targets: list[Any]) -> Unobserved | None:
    """What a result's object says was not observed; ``targets`` are its target poses with their nulls."""
    found = data.get("unobserved_motions")
    if not found:
        return None
    hidden = np.array(targets, dtype=object) == None  # noqa: E711 - cell by cell
    return Unobserved(tuple(data["unobserved"]), found["motions"], found["tolerance"], hidden)
