"""What are a shot's millimetres worth beside its degrees, if only the recording itself may say?

Eq. (11) needs a length ℓ. With the target's position in error by s_t and its orientation by s_r about each axis, both
unknown, the most likely head minimises Σ|e_t|²/s_t² + Σ|e_r|²/s_r². A small turn δ changes the entries of a rotation
by √2 |δ|, so that this is eq. (11) with ℓ = s_t / (√2 s_r), and at the maximum of the likelihood s_t and s_r are the
scatter of the answer itself. ℓ and head are found in turn until they agree; for every ℓ the head is the proven global
minimum. Lengths in another unit give the same head.
"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.head.certificate import solve_certified
from sixthlink.calibrate.head.factor import Objective, objective
from sixthlink.calibrate.head.problem import HeadProblem, scatter

__all__ = ["likeliest_objective"]

ROUNDS = 50
"""Most rounds of head and ℓ."""

SETTLED = 1e-4
"""Relative change of ℓ at which the rounds end: the head then moves by far less than its uncertainty."""

LENGTH_RANGE = 1e3
"""ℓ stays within this factor of the flange's travel: exact shots leave no scatter to weigh by."""


def likeliest_objective(problem: HeadProblem) -> Objective:
    """Eq. (11) with the ℓ under which the recording's own scatter is the most likely one.

    Args:
        problem: The shots.
    """
    positions_m = problem.Ts_outer[:, :3, 3]
    travel_m = float(np.linalg.norm(positions_m.std(axis=0))) or 1.0
    found = objective(problem, travel_m)
    for _ in range(ROUNDS):
        seen = scatter(problem, solve_certified(found)[0])
        length_m = seen.rms_translation_m / max(np.sqrt(2.0) * seen.rms_rotation_rad, np.finfo(np.float64).tiny)
        length_m = float(np.clip(length_m, travel_m / LENGTH_RANGE, travel_m * LENGTH_RANGE))
        change = abs(np.log(length_m / found.rotation_length_m))
        found = objective(problem, length_m)
        if change < SETTLED:
            break
    return found
