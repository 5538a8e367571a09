"""How sure is the instrument of each point?

One standard deviation for all coordinates, one for the range and one for the angles, columns of the table, or an
explicit ``unknown``.
"""

from __future__ import annotations

import numpy as np

from sixthlink.files.tracker_grid import note_rows
from sixthlink.files.tracker_schema import SIGMA_COLUMNS, UNKNOWN, PolarSigma
from sixthlink.files.tracker_sheets import Sheet, TableTask, numbers_of, table_finding
from sixthlink.geometry import Floats

__all__ = ["check_noise", "row_covariances"]

_UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Places of the columns cxx, cxy, cxz, cyy, cyz, czz."""


def check_noise(task: TableTask) -> bool:
    """Whether the table has columns of noise exactly where ``sigma: columns`` says so; findings go to the task."""
    before, columns, sigma = len(task.findings), task.table.columns, task.description.sigma
    given = [key for key in ("sigma", "covariance") if getattr(columns, key) is not None]
    if sigma == SIGMA_COLUMNS and len(given) != 1:
        what = f"sigma is {SIGMA_COLUMNS}, but {'two kinds of them are' if given else 'none is'} named"
        cure = "write for example 'columns: {sigma: [sx, sy, sz]}'"
        table_finding(task, ("columns",), what, "sigma or covariance", cure)
    if sigma not in (None, SIGMA_COLUMNS) and given:
        what, cure = f"is named, but sigma is not {SIGMA_COLUMNS}", f"write sigma: {SIGMA_COLUMNS}, or remove it"
        table_finding(task, ("columns", given[0]), what, "", cure, at_key=True)
    if columns.sigma is not None and len(columns.sigma) == 2:
        table_finding(task, ("columns", "sigma"), "is a list of 2", "1 column for all axes, or 3", "correct it")
    return len(task.findings) == before


def row_covariances(task: TableTask, sheet: Sheet, points: Floats) -> Floats | None:
    """Covariances ``(N, 3, 3)`` [m²] of the rows with points ``(N, 3)`` [m], or None where they are unknown."""
    length_m, angle_rad = task.factors
    sigma, columns = task.description.sigma, sheet.columns
    if isinstance(sigma, PolarSigma):
        return _polar(points, sigma.range * length_m, sigma.angle * angle_rad)
    if isinstance(sigma, float):
        return np.tile(np.eye(3) * (sigma * length_m) ** 2, (len(points), 1, 1))
    if sigma == UNKNOWN or sigma is None:
        return None
    before, places = len(task.findings), columns.sigma or columns.covariance
    values = numbers_of(sheet, places, task.findings)
    if len(task.findings) > before:
        return None
    covariances = np.zeros((len(points), 3, 3))
    if columns.sigma:
        covariances[:, range(3), range(3)] = (values / task.table.coverage * length_m) ** 2
    else:
        for j, (a, b) in enumerate(_UPPER):
            covariances[:, a, b] = covariances[:, b, a] = values[:, j] * (length_m / task.table.coverage) ** 2
    sound = np.linalg.eigvalsh(covariances)[:, 0] > 0
    sound &= (values > 0).all(axis=1) if columns.sigma else True
    what = "is not above 0" if columns.sigma else "begins a covariance that is not positive definite"
    expected = "an uncertainty above 0 in every direction"
    cure = "give it more digits if it was rounded to 0, or write one sigma for all points"
    note_rows(
        sheet.grid, places[0], np.flatnonzero(~sound), lambda _: what, task.findings, expected=expected, cure=cure
    )
    return covariances


def _polar(points: Floats, range_m: float, angle_rad: float) -> Floats:
    """Noise along and across the line of sight, which begins at the origin of the instrument's frame."""
    distances = np.linalg.norm(points, axis=1)
    sights = points / np.where(distances > 0, distances, 1.0)[:, None]
    along = sights[:, :, None] * sights[:, None, :]
    across = np.maximum((distances * angle_rad) ** 2, np.finfo(float).tiny)[:, None, None]
    return range_m**2 * along + across * (np.eye(3) - along)
