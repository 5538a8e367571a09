"""Which solver predicts shots that it has not seen best, on this very recording, and is the difference more than noise?

A small residual on the shots that made it proves nothing. Every solver is given the recording without some shots
(or without a whole placement) and judged on those: how far its prediction of their target pose is off.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.certificate import Certificate, certificate_of, solve_certified
from sixthlink.calibrate.head.closed_form import CLOSED_FORMS
from sixthlink.calibrate.head.factor import Objective, objective
from sixthlink.calibrate.head.problem import HeadProblem, placement_poses, scatter
from sixthlink.calibrate.head.search import search_box, search_head
from sixthlink.calibrate.head.weights import likeliest_objective
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats, Ints, inverse, mean_transform, rotation_angle
from sixthlink.progress import Progress, Silent
from sixthlink.solvers import SwarmBudget

__all__ = ["LIKELIEST", "Solver", "SolverScore", "compare_solvers", "heldout_errors", "solvers"]

LIKELIEST = "certified"
"""Name of the proven solution with ℓ taken from the recording's own scatter."""

FOLDS = 10
"""Parts into which the shots are dealt for cross-validation."""

REPETITIONS = 3
"""Runs of which the quickest counts as a solver's time."""

Weigh = Callable[[HeadProblem], Objective]


@dataclass(frozen=True)
class Solver:
    """A way from shots to a head, and the sum that its answer is judged by.

    Attributes:
        solve: Head ``(4, 4)`` of a problem.
        weigh: Eq. (11) with the ℓ that the solver minimises, or with metres where it minimises something else.
    """

    solve: Callable[[HeadProblem], Floats]
    weigh: Weigh


@dataclass(frozen=True, eq=False)
class SolverScore:
    """How one solver did on one recording.

    Attributes:
        name: Name of the solver.
        scatter_translation_m: RMS scatter on the shots that made the answer [m].
        scatter_rotation_rad: The same for rotation [rad].
        heldout_translation_m: RMS error on shots that the solver did not see [m].
        heldout_rotation_rad: The same for rotation [rad].
        heldout_translations_m: ``(N,)`` error of each shot when it was held out [m].
        heldout_rotations_rad: ``(N,)`` the same for rotation [rad].
        placement_translation_m: RMS scatter within placements that the solver did not see [m], or None with one.
        placement_rotation_rad: The same for rotation [rad], or None.
        time_s: Time of one solve of the whole recording [s].
        certificate: Judgement of the answer as a minimum of eq. (11) with the solver's own ℓ.
        rotation_length_m: That ℓ; 1 m for solvers that minimise another sum [m].
        failure: Why there is no answer; everything else is then zero.
    """

    name: str
    scatter_translation_m: float = 0.0
    scatter_rotation_rad: float = 0.0
    heldout_translation_m: float = 0.0
    heldout_rotation_rad: float = 0.0
    heldout_translations_m: Floats | None = None
    heldout_rotations_rad: Floats | None = None
    placement_translation_m: float | None = None
    placement_rotation_rad: float | None = None
    time_s: float = 0.0
    certificate: Certificate | None = None
    rotation_length_m: float = 1.0
    failure: str = ""


def solvers(seed: int) -> dict[str, Solver]:
    """Every solver by name: the proven solutions, the swarms with polish, and the closed forms of the field."""

    def proven(weigh: Weigh) -> Solver:
        return Solver(lambda problem: solve_certified(weigh(problem))[0], weigh)

    def swarm(variant: str, budget: SwarmBudget) -> Solver:
        def solve(problem: HeadProblem) -> Floats:
            return search_head(
                objective(problem, 1.0),
                search_box(problem),
                seed=seed,
                budget=budget,
                progress=Silent(),
                variant=variant,
            )[0]

        return Solver(solve, in_metres)

    def closed(form: Callable[[Floats, Floats, Ints], Floats]) -> Solver:
        return Solver(lambda problem: form(problem.Ts_outer, problem.Ts_inner, problem.placements), in_metres)

    def in_metres(problem: HeadProblem) -> Objective:
        return objective(problem, 1.0)

    return {
        LIKELIEST: proven(likeliest_objective),
        "certified-metres": proven(in_metres),
        "certified-millimetres": proven(objective),
        "qpso-paper": swarm("paper", SwarmBudget(4, 40, 300)),
        "qpso-robust": swarm("robust", SwarmBudget(4, 12, 40)),
    } | {name: closed(form) for name, form in CLOSED_FORMS.items()}


def compare_solvers(problem: HeadProblem, *, seed: int, progress: Progress) -> tuple[SolverScore, ...]:
    """Every solver on one recording, judged on shots and placements that it did not see.

    Args:
        problem: The recording's shots.
        seed: Seed of the dealing of the shots and of the swarms.
        progress: Listener.
    """
    candidates = solvers(seed)
    scores = []
    for k, (name, solver) in enumerate(candidates.items()):
        progress.step("compare solvers", k, len(candidates))
        try:
            scores.append(_score(name, solver, problem, seed))
        except (CalibrationError, np.linalg.LinAlgError) as refusal:
            scores.append(SolverScore(name, failure=str(refusal)))
    progress.step("compare solvers", len(candidates), len(candidates))
    return tuple(scores)


def heldout_errors(problem: HeadProblem, solver: Solver, seed: int) -> tuple[Floats, Floats]:
    """Distance ``(N,)`` [m] and angle ``(N,)`` [rad] of each shot's target to its prediction without that shot.

    Args:
        problem: The recording's shots.
        solver: Judged on ten folds.
        seed: Seed of the dealing of the shots into folds.
    """
    translations, rotations = np.zeros(len(problem.placements)), np.zeros(len(problem.placements))
    for train, judged in _shot_folds(problem, seed):
        part = _part(problem, train)
        translations[judged], rotations[judged] = _prediction_errors(problem, part, judged, solver.solve(part))
    return translations, rotations


def _score(name: str, solver: Solver, problem: HeadProblem, seed: int) -> SolverScore:
    times = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        X = solver.solve(problem)
        times.append(time.perf_counter() - start)
    translations, rotations = heldout_errors(problem, solver, seed)
    by_placement = _placement_scatter(problem, solver)
    weighed = solver.weigh(problem)
    found = scatter(problem, X)
    return SolverScore(
        name=name,
        scatter_translation_m=found.rms_translation_m,
        scatter_rotation_rad=found.rms_rotation_rad,
        heldout_translation_m=_rms(translations),
        heldout_rotation_rad=_rms(rotations),
        heldout_translations_m=translations,
        heldout_rotations_rad=rotations,
        placement_translation_m=by_placement[0] if by_placement else None,
        placement_rotation_rad=by_placement[1] if by_placement else None,
        time_s=min(times),
        certificate=certificate_of(weighed, X[:3, :3]),
        rotation_length_m=weighed.rotation_length_m,
    )


def _shot_folds(problem: HeadProblem, seed: int) -> Iterator[tuple[Ints, Ints]]:
    """Training and judged shots ``(n,)`` of each fold; every placement keeps at least two shots to train on."""
    rng = np.random.default_rng(seed)
    fold = np.empty(len(problem.placements), dtype=np.int64)
    for p in np.unique(problem.placements):
        members = rng.permutation(np.flatnonzero(problem.placements == p))
        fold[members] = np.arange(len(members)) % min(FOLDS, len(members))
    for k in range(int(fold.max()) + 1):
        yield np.flatnonzero(fold != k), np.flatnonzero(fold == k)


def _part(problem: HeadProblem, shots: Ints) -> HeadProblem:
    numbers = np.unique(problem.placements[shots], return_inverse=True)[1]
    return HeadProblem(problem.Ts_outer[shots], problem.Ts_inner[shots], numbers)


def _prediction_errors(problem: HeadProblem, train: HeadProblem, judged: Ints, X: Floats) -> tuple[Floats, Floats]:
    """Distance [m] and angle [rad] of the judged shots' targets to where the training shots put them."""
    known = np.unique(np.delete(problem.placements, judged))
    expected = placement_poses(train, X)[np.searchsorted(known, problem.placements[judged])]
    deviations = inverse(expected) @ problem.Ts_outer[judged] @ X @ problem.Ts_inner[judged]
    return np.linalg.norm(deviations[:, :3, 3], axis=1), rotation_angle(deviations[:, :3, :3])


def _placement_scatter(problem: HeadProblem, solver: Solver) -> tuple[float, float] | None:
    """RMS scatter [m, rad] inside each placement under a head from the other placements; None with one placement."""
    names = np.unique(problem.placements)
    if len(names) < 2:
        return None
    translations, rotations = [], []
    for p in names:
        judged = np.flatnonzero(problem.placements == p)
        X = solver.solve(_part(problem, np.flatnonzero(problem.placements != p)))
        Ts_target = problem.Ts_outer[judged] @ X @ problem.Ts_inner[judged]
        deviations = inverse(mean_transform(Ts_target)) @ Ts_target
        translations.append(np.linalg.norm(deviations[:, :3, 3], axis=1))
        rotations.append(rotation_angle(deviations[:, :3, :3]))
    return _rms(np.concatenate(translations)), _rms(np.concatenate(rotations))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
