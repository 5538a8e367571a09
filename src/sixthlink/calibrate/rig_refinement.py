"""Which lenses, camera poses and target poses together explain all pixels of a head best?

Least squares on the pixels of every camera and shot at once, in double precision, with derivatives in closed form.
Target poses are eliminated shot by shot (Schur complement), so the cost grows linearly with the number of shots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.camera import CameraRig, RigUnknowns, lens_vector, moved_rig, rig_pixels
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats, Ints, apply_motion, hat

__all__ = ["RigFit", "RigProblem", "prior_information", "refine_rig", "unseen_lens"]

ITERATIONS = 60

LEAST_EIGENVALUE = 1e-15
"""Below this eigenvalue of the scaled normal matrix a direction of the lenses is lost in rounding."""


@dataclass(frozen=True, eq=False)
class RigProblem:
    """Observations, sorted by shot, and what is free.

    Attributes:
        slots: ``(M,)`` position of each row's shot in ``0 ... S-1``, ascending, every shot present.
        cameras: ``(M,)`` index of the camera.
        points: ``(M,)`` number of the target's point.
        points_target: ``(M, 3)`` where it is in the target frame [m].
        pixels: ``(M, 2)`` observed [pixel].
        sigmas_px: ``(M,)`` standard deviation of each coordinate [pixel]; only ratios matter to the answer.
        unknowns: What of the rig is free.
        lens_prior: ``(C, 16)`` standard deviation of each lens term about zero before any image was seen; infinite
            where nothing is known.
    """

    slots: Ints
    cameras: Ints
    points: Ints
    points_target: Floats
    pixels: Floats
    sigmas_px: Floats
    unknowns: RigUnknowns
    lens_prior: Floats


@dataclass(frozen=True, eq=False)
class RigFit:
    """The best explanation.

    Attributes:
        rig: Lenses and camera poses.
        Ts_head_target: ``(S, 4, 4)`` target pose of each shot.
        residuals_px: ``(M, 2)`` predicted minus observed [pixel].
        noise_px: Standard deviation of a pixel coordinate, with the fitted parameters accounted for [pixel].
        covariance: ``(G, G)`` of the free parameters: the free lens terms camera by camera, then the free poses'
            motions (δp [m], δθ [rad]), scaled to the residuals.
    """

    rig: CameraRig
    Ts_head_target: Floats
    residuals_px: Floats
    noise_px: float
    covariance: Floats


@dataclass(frozen=True, eq=False)
class _System:
    """Residuals and the normal equations, split into what is shared and what belongs to one shot."""

    residuals_px: Floats
    cost: float
    shared: Floats
    shared_gradient: Floats
    cross: Floats
    own: Floats
    own_gradient: Floats


def refine_rig(problem: RigProblem, rig: CameraRig, Ts_head_target: Floats) -> RigFit:
    """Damped least squares (Levenberg 1944, Marquardt 1963) from a start.

    Args:
        problem: Observations and what is free.
        rig: Start of the lenses and camera poses.
        Ts_head_target: ``(S, 4, 4)`` start of the target poses.

    Raises:
        CalibrationError: The start puts points behind a camera, or the views leave a direction of the lenses unseen.
    """
    system = _system(problem, rig, Ts_head_target)
    if system is None:
        raise CalibrationError(
            "the first estimate of the cameras puts points of the target behind a camera; check the target's "
            "description and that the images are not mirrored"
        )
    damping = 1e-5
    for _ in range(ITERATIONS):
        step, steps = _step(system, damping)
        tried_rig, tried_poses = moved_rig(rig, problem.unknowns, step), apply_motion(Ts_head_target, steps)
        tried = _system(problem, tried_rig, tried_poses) if tried_rig is not None else None
        if tried_rig is None or tried is None or not tried.cost <= system.cost:
            damping *= 10.0
            if damping > 1e8:
                break
            continue
        gain = system.cost - tried.cost
        rig, Ts_head_target, system = tried_rig, tried_poses, tried
        damping = max(damping * 0.1, 1e-12)
        if gain <= 1e-12 * system.cost:
            break
    return _fit(problem, rig, Ts_head_target, system)


def _system(problem: RigProblem, rig: CameraRig, Ts_head_target: Floats) -> _System | None:
    """Linearised problem, or None when a point is not in front of a camera."""
    M, G = len(problem.slots), problem.unknowns.size
    T = Ts_head_target[problem.slots]
    lever = (T[:, :3, :3] @ problem.points_target[:, :, None])[:, :, 0]
    predicted, by_head, J, visible = rig_pixels(rig, problem.cameras, lever + T[:, :3, 3], problem.unknowns)
    if not visible.all():
        return None
    residuals = predicted - problem.pixels
    J_own = np.concatenate([by_head, -by_head @ hat(lever)], axis=2)
    weight = 1.0 / problem.sigmas_px[:, None]
    r, J, J_own = residuals * weight, J * weight[:, :, None], J_own * weight[:, :, None]
    starts = np.searchsorted(problem.slots, np.arange(len(Ts_head_target)))
    flat = J.reshape(2 * M, G)
    before, terms = prior_information(problem), free_terms(problem, rig)
    return _System(
        residuals_px=residuals,
        cost=float(np.sum(r * r) + np.sum(before * terms**2)),
        shared=flat.T @ flat + np.diag(before),
        shared_gradient=flat.T @ r.ravel() + before * terms,
        cross=np.add.reduceat(np.swapaxes(J_own, 1, 2) @ J, starts),
        own=np.add.reduceat(np.swapaxes(J_own, 1, 2) @ J_own, starts),
        own_gradient=np.add.reduceat((np.swapaxes(J_own, 1, 2) @ r[:, :, None])[:, :, 0], starts),
    )


def prior_information(problem: RigProblem) -> Floats:
    """Information ``(G,)`` that every free parameter has before any image was seen."""
    lens = 1.0 / problem.lens_prior[problem.unknowns.lens] ** 2
    return np.concatenate([lens, np.zeros(problem.unknowns.size - len(lens))])


def free_terms(problem: RigProblem, rig: CameraRig) -> Floats:
    """Values ``(G,)`` of the free lens terms; zero for camera poses, which have no prior."""
    lenses = np.stack([lens_vector(camera) for camera in rig.cameras])[problem.unknowns.lens]
    return np.concatenate([lenses, np.zeros(problem.unknowns.size - len(lenses))])


def _step(system: _System, damping: float) -> tuple[Floats, Floats]:
    """Damped step of the shared parameters ``(G,)`` and of each target pose ``(S, 6)``."""
    own = system.own + damping * np.einsum("sii->si", system.own)[:, :, None] * np.eye(6)
    shared = system.shared + damping * np.diag(np.diag(system.shared))
    eliminated = np.linalg.solve(own, np.concatenate([system.cross, system.own_gradient[:, :, None]], axis=2))
    crossed = np.swapaxes(system.cross, 1, 2)
    reduced = shared - (crossed @ eliminated[:, :, :-1]).sum(axis=0)
    gradient = system.shared_gradient - (crossed @ eliminated[:, :, -1:]).sum(axis=0)[:, 0]
    scale = 1.0 / np.sqrt(np.diag(shared))
    step = -scale * np.linalg.lstsq(reduced * scale[:, None] * scale, gradient * scale, rcond=1e-15)[0]
    return step, -eliminated[:, :, -1] - eliminated[:, :, :-1] @ step


def _fit(problem: RigProblem, rig: CameraRig, Ts_head_target: Floats, system: _System) -> RigFit:
    """The answer with its covariance."""
    G, S, M = len(system.shared), len(system.own), len(problem.slots)
    freedom = 2 * M - G - 6 * S
    if freedom < 1:
        raise CalibrationError(f"{2 * M} pixel coordinates cannot carry {G + 6 * S} unknowns; record more shots")
    crossed = np.swapaxes(system.cross, 1, 2)
    information = system.shared - (crossed @ np.linalg.solve(system.own, system.cross)).sum(axis=0)
    if G:
        scale = 1.0 / np.sqrt(np.diag(system.shared))
        values = np.linalg.eigvalsh(information * scale[:, None] * scale)
        if values[0] < LEAST_EIGENVALUE * values[-1]:
            raise CalibrationError(unseen_lens())
    return RigFit(
        rig=rig,
        Ts_head_target=Ts_head_target,
        residuals_px=system.residuals_px,
        noise_px=float(np.sqrt(np.sum(system.residuals_px**2) / freedom)),
        covariance=np.linalg.inv(information) * (system.cost / freedom),
    )


def unseen_lens(where: str = "") -> str:
    """Cause and cure when views cannot tell a lens from a distance."""
    return (
        f"the views do not determine the intrinsics{where}: all show the target at nearly the same tilt; record at "
        "least three shots with the target tilted by 15° to 30° about different axes, or give the intrinsics"
    )
