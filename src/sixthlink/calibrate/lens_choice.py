"""Does a lens ask for more than k1, k2, p1, p2 and k3?

Wide lenses bend in a way that a polynomial follows only roughly, fisheyes show angles instead of tangents, and lenses
built askew shift the image beside the tangential terms. Rational and thin-prism terms, or a fisheye, enter where views
that a fit has not seen are predicted better: the shots are dealt into parts, each is predicted by lenses fitted to the
others (its own target pose fitted with those lenses), and the mean gain must stand out from its scatter. That is only
asked where they fit the seen views better than chance lets them. Of several that enter, the one with the fewest terms
is taken that predicts as well as the best one within a standard error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from sixthlink.calibrate.fisheye_start import FISHEYE_FREE, bending_alike
from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, refine_rig
from sixthlink.camera import FISHEYE, LENS_NAMES, CameraRig, RigUnknowns, rays_from_pixels
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats, Ints

__all__ = ["FAMILIES", "LensVerdict", "lens_choice"]

FAMILIES = {"rational": ("k3", "k4", "k5", "k6"), "thin prism": ("k3", "s1", "s2", "s3", "s4")}
"""Terms that are tried together, by the name of the model."""

FISHEYE_FROM_RAD = np.deg2rad(30.0)
"""A fisheye is tried where points were seen farther than this from the axis."""

FOLDS = 4
FEWEST_SHOTS = 8
STANDARD_ERRORS = 2.0

BY_CHANCE = 1e-6
"""Chance of so much better a fit by needless terms, from which unseen views are asked."""

EXPLAINED = 0.03
"""Share of the squared residuals that more terms must explain, in seen as in unseen views."""


@dataclass(frozen=True)
class LensVerdict:
    """Whether a richer lens model entered.

    Attributes:
        model: Its name.
        entered: Whether it is used.
        gain: Mean logarithm, over shots, of the squared residual by the plain lens over that by the richer one [-].
        standard_error: Of that mean [-].
    """

    model: str
    entered: bool
    gain: float
    standard_error: float


@dataclass(frozen=True, eq=False)
class _Answer:
    """A richer model that predicts unseen views better than the plain one, and its gain ``(S,)`` in each shot."""

    verdict: LensVerdict
    by_shot: Floats
    problem: RigProblem
    fit: RigFit


def lens_choice(problem: RigProblem, fit: RigFit) -> tuple[tuple[LensVerdict, ...], RigProblem, RigFit]:
    """Verdicts on the richer models, and problem and fit with the best that entered.

    Args:
        problem: Observations, with the terms of the plain lens free.
        fit: Their best explanation by plain lenses.
    """
    S = len(fit.Ts_head_target)
    if S < FEWEST_SHOTS or not problem.unknowns.lens.any() or any(c.model == FISHEYE for c in fit.rig.cameras):
        return (), problem, fit
    plain: Floats | None = None
    verdicts: list[LensVerdict] = []
    answers: list[_Answer] = []
    for name, richer, rig in _richer(problem, fit):
        try:
            found = refine_rig(richer, rig, fit.Ts_head_target)
            if not _fits_better(problem, fit, richer, found):
                continue
            plain = _heldout(problem, fit) if plain is None else plain
            unseen = _heldout(richer, found)
        except CalibrationError:
            continue
        # One view that a lens cannot reach at all must not decide for all of them: ratios, shot by shot.
        by_shot = np.log(np.bincount(problem.slots, plain) / np.bincount(problem.slots, unseen))
        gain, error = float(by_shot.mean()), float(by_shot.std(ddof=1) / np.sqrt(S))
        verdicts.append(LensVerdict(name, False, gain, error))
        if gain > max(STANDARD_ERRORS * error, EXPLAINED):
            answers.append(_Answer(verdicts[-1], by_shot, richer, found))
    if not answers:
        return tuple(verdicts), problem, fit
    best = max(answers, key=lambda answer: answer.verdict.gain)
    as_good = [answer for answer in answers if _as_good(answer.by_shot, best.by_shot)]
    chosen = min(as_good, key=lambda answer: answer.problem.unknowns.size)
    return tuple(replace(v, entered=v is chosen.verdict) for v in verdicts), chosen.problem, chosen.fit


def _as_good(by_shot: Floats, best: Floats) -> bool:
    """Whether a model loses against the best one by no more than the standard error of their difference."""
    lost = best - by_shot
    return bool(lost.mean() <= lost.std(ddof=1) / np.sqrt(len(lost)))


def _richer(problem: RigProblem, fit: RigFit) -> Iterator[tuple[str, RigProblem, CameraRig]]:
    """The richer models that may be tried: name, problem and start."""
    lens = problem.unknowns.lens
    own = lens[:, LENS_NAMES.index("fx")]
    for name, terms in FAMILIES.items():
        free = lens.copy()
        free[:, np.isin(LENS_NAMES, terms)] |= own[:, None]
        yield name, replace(problem, unknowns=RigUnknowns(free, problem.unknowns.pose)), fit.rig
    cameras = list(fit.rig.cameras)
    widest_rad = 0.0
    for c in np.flatnonzero(own).tolist():
        pixels = problem.pixels[problem.cameras == c]
        try:
            rays = rays_from_pixels(cameras[c], pixels)
        except ValueError:
            return
        widest_rad = max(widest_rad, float(np.arctan(np.linalg.norm(rays[:, :2], axis=1).max(initial=0.0))))
        cameras[c] = bending_alike(cameras[c], pixels)
    if widest_rad > FISHEYE_FROM_RAD:
        free = np.where(own[:, None], FISHEYE_FREE, lens)
        unknowns = RigUnknowns(free, problem.unknowns.pose)
        yield FISHEYE, replace(problem, unknowns=unknowns), replace(fit.rig, cameras=tuple(cameras))


def _fits_better(problem: RigProblem, fit: RigFit, richer: RigProblem, found: RigFit) -> bool:
    """Whether more terms fit the seen views better than chance lets them (F test)."""
    before, after = (float(np.sum((f.residuals_px / problem.sigmas_px[:, None]) ** 2)) for f in (fit, found))
    more = richer.unknowns.size - problem.unknowns.size
    dof = max(2 * len(problem.slots) - richer.unknowns.size - 6 * len(fit.Ts_head_target), 1)
    F = (before - after) / max(more, 1) / (after / dof)
    return before - after > EXPLAINED * before and float(fdtrc(max(more, 1), dof, F)) < BY_CHANCE


def _heldout(problem: RigProblem, fit: RigFit) -> Floats:
    """Squared whitened residual ``(M,)`` of every point, its shot unseen by the lenses that predict it."""
    S = len(fit.Ts_head_target)
    fold = np.random.default_rng(0).permutation(np.arange(S) % FOLDS)
    squares = np.zeros(len(problem.slots))
    for k in range(FOLDS):
        seen, unseen = np.flatnonzero(fold != k), np.flatnonzero(fold == k)
        lenses = refine_rig(_part(problem, seen), fit.rig, fit.Ts_head_target[seen]).rig
        rows = np.isin(problem.slots, unseen)
        squares[rows] = _predicted(_part(problem, unseen), lenses, fit.Ts_head_target[unseen])
    return squares


def _part(problem: RigProblem, shots: Ints) -> RigProblem:
    rows = np.isin(problem.slots, shots)
    return replace(
        problem,
        slots=np.searchsorted(shots, problem.slots[rows]),
        cameras=problem.cameras[rows],
        points=problem.points[rows],
        points_target=problem.points_target[rows],
        pixels=problem.pixels[rows],
        sigmas_px=problem.sigmas_px[rows],
    )


def _predicted(problem: RigProblem, rig: CameraRig, Ts_head_target: Floats) -> Floats:
    """Squared whitened residuals of shots whose target poses alone are fitted."""
    held = RigUnknowns(np.zeros_like(problem.unknowns.lens), np.zeros_like(problem.unknowns.pose))
    found = refine_rig(replace(problem, unknowns=held), rig, Ts_head_target)
    return np.asarray(np.sum((found.residuals_px / problem.sigmas_px[:, None]) ** 2, axis=1), dtype=np.float64)
