"""What does the robot know about the lens of a single camera?

A plane seen by one camera leaves focal length, principal point and depth nearly exchangeable; a few pixels of
principal point are a few tenths of a degree of the head. The robot's poses tell them apart. Pixels and eq. (10) are
fitted together: lens, head, placements and every shot's target pose, the pixels weighed by their noise and the loop
of eq. (10) by its own scatter, so that an inaccurate robot cannot drag the lens away. Nor can a board whose declared
size is in doubt: then the scale of all seen distances is one more unknown. The shots' poses are eliminated one by one
(Schur complement); the cost is linear in the shots.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.head import HeadProblem, placement_poses, scatter
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.camera import Camera, CameraRig, camera_with_lens, lens_vector, pixel_jacobian
from sixthlink.geometry import Floats, Ints, apply_motion, hat, motion_between
from sixthlink.recording import selected

__all__ = ["refine_lens_with_robot"]

ITERATIONS = 30
ROUNDS = 3
"""Times that the loop's scatter is estimated anew from the better lens."""

SURE, DOUBTED = 1e-6, 0.02
"""Standard deviation of the board's size against the robot's lengths: as declared, and where the robot doubts it."""


@dataclass(frozen=True, eq=False)
class _Data:
    """Pixels sorted by shot, and what of the lens is free."""

    slots: Ints
    starts: Ints
    points_target: Floats
    pixels: Floats
    noise_px: float
    scale_sigma: float
    free: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _State:
    """What is fitted."""

    lens: Floats
    X: Floats
    scale: float
    Ts_base_target: Floats
    Ts_head_target: Floats


def refine_lens_with_robot(
    cameras: RigCalibration, points_m: Floats, shots: Ints, problem: HeadProblem, X: Floats, *, doubted: bool
) -> RigCalibration:
    """The lens of a single calibrated camera, fitted to pixels and robot together.

    Args:
        cameras: The camera as its images alone determine it.
        points_m: ``(P, 3)`` points of the target [m].
        shots: ``(N,)`` index in the recording of each shot of the problem.
        problem: Eq. (10) with the poses under that camera.
        X: ``(4, 4)`` the head under that camera.
        doubted: Whether the declared size of the target is in doubt.

    Returns:
        The same calibration with the better lens and its standard deviations.
    """
    camera, evidence = cameras.rig.cameras[0], cameras.cameras[0]
    rows = np.isin(cameras.detections.shots, shots)
    seen = selected(cameras.detections, rows)
    order = np.argsort(seen.shots, kind="stable")
    slots = np.searchsorted(shots, seen.shots[order])
    data = _Data(
        slots=slots,
        starts=np.searchsorted(slots, np.arange(len(shots))),
        points_target=points_m[seen.points[order]],
        pixels=seen.pixels[order],
        noise_px=cameras.noise_px,
        scale_sigma=DOUBTED if doubted else SURE,
        free=evidence.std > 0.0,
    )
    state = _State(lens_vector(camera), X, 1.0, placement_poses(problem, X), problem.Ts_inner)
    covariance = np.zeros((len(state.lens), len(state.lens)))
    for _ in range(ROUNDS):
        found = scatter(replace(problem, Ts_inner=state.Ts_head_target), state.X)
        sigmas = np.repeat([found.rms_translation_m, found.rms_rotation_rad], 3) / np.sqrt(3.0)
        state, covariance = _fitted(camera, data, problem, state, np.maximum(sigmas, 1e-9))
    better = camera_with_lens(camera, state.lens)
    rig = CameraRig(cameras.rig.names, (better,), cameras.rig.Ts_camera_head)
    std = np.sqrt(np.diag(covariance))
    return replace(cameras, rig=rig, cameras=(replace(evidence, std=std),))


def _fitted(camera: Camera, data: _Data, problem: HeadProblem, state: _State, sigmas: Floats) -> tuple[_State, Floats]:
    """Damped least squares with every shot's pose eliminated; also the lens covariance ``(16, 16)``."""
    cost, blocks = _linearised(camera, data, problem, state, sigmas)
    damping = 1e-6
    for _ in range(ITERATIONS):
        tried = _stepped(state, data, *_solved(blocks, damping))
        new_cost, new_blocks = _linearised(camera, data, problem, tried, sigmas)
        if new_cost <= cost:
            done = cost - new_cost <= 1e-9 * cost
            state, cost, blocks, damping = tried, new_cost, new_blocks, damping * 0.1
            if done:
                break
        else:
            damping = damping * 10.0
            if damping > 1e3:
                break
    shared = np.linalg.pinv(_reduced(blocks, 0.0)[0], hermitian=True)
    covariance = np.zeros((len(state.lens), len(state.lens)))
    free = np.flatnonzero(data.free)
    covariance[np.ix_(free, free)] = shared[: len(free), : len(free)]
    return state, covariance


_Blocks = tuple[Floats, Floats, Floats, Floats, Floats]
"""Normal equations: shared × shared, shot × shot, shot × shared, and the two gradients."""


def _linearised(
    camera: Camera, data: _Data, problem: HeadProblem, state: _State, sigmas: Floats
) -> tuple[float, _Blocks]:
    T = state.Ts_head_target[data.slots]
    lever = (T[:, :3, :3] @ data.points_target[:, :, None])[:, :, 0]
    points_camera = lever + T[:, :3, 3]
    if (points_camera[:, 2] <= 0.0).any() or (state.lens[:2] <= 0.0).any():
        return np.inf, (np.zeros((0, 0)),) * 5
    predicted, by_point, by_lens = pixel_jacobian(camera_with_lens(camera, state.lens), points_camera)
    r = (predicted - data.pixels) / data.noise_px
    A = by_lens[:, :, data.free] / data.noise_px
    B = np.concatenate([by_point, -by_point @ hat(lever)], axis=-1) / data.noise_px
    loop, by_shot, by_shared = _loop(problem, state, sigmas, A.shape[2])
    H_ss = np.einsum("nki,nkj->ij", by_shared, by_shared)
    H_ss[: A.shape[2], : A.shape[2]] += np.einsum("mki,mkj->ij", A, A)
    H_tt = np.einsum("nki,nkj->nij", by_shot, by_shot)
    H_tt += np.add.reduceat(np.einsum("mki,mkj->mij", B, B), data.starts, axis=0)
    H_ts = np.einsum("nki,nkj->nij", by_shot, by_shared)
    H_ts[:, :, : A.shape[2]] += np.add.reduceat(np.einsum("mki,mkj->mij", B, A), data.starts, axis=0)
    g_s = np.einsum("nki,nk->i", by_shared, loop)
    g_s[: A.shape[2]] += np.einsum("mki,mk->i", A, r)
    g_t = np.einsum("nki,nk->ni", by_shot, loop)
    g_t += np.add.reduceat(np.einsum("mki,mk->mi", B, r), data.starts, axis=0)
    surprise = (state.scale - 1.0) / data.scale_sigma
    H_ss[-1, -1] += data.scale_sigma**-2
    g_s[-1] += surprise / data.scale_sigma
    return float(np.sum(r**2) + np.sum(loop**2) + surprise**2), (H_ss, H_tt, H_ts, g_s, g_t)


def _loop(problem: HeadProblem, state: _State, sigmas: Floats, lens_terms: int) -> tuple[Floats, Floats, Floats]:
    """Whitened residual of eq. (10) ``(N, 6)``, and its derivatives by each shot's pose and by all that is shared."""
    seen = state.Ts_head_target.copy()
    seen[:, :3, 3] *= state.scale
    Ts_target = problem.Ts_outer @ state.X @ seen
    residual = motion_between(state.Ts_base_target[problem.placements], Ts_target) / sigmas
    R_outer = problem.Ts_outer[:, :3, :3]
    turn = R_outer @ state.X[:3, :3]
    N, P = len(residual), len(state.Ts_base_target)
    by_shot, by_shared = np.zeros((N, 6, 6)), np.zeros((N, 6, lens_terms + 6 + 6 * P + 1))
    by_shot[:, :3, :3], by_shot[:, 3:, 3:] = state.scale * turn, turn
    head = by_shared[:, :, lens_terms : lens_terms + 6]
    head[:, :3, :3] = head[:, 3:, 3:] = R_outer
    head[:, :3, 3:] = -R_outer @ hat(seen[:, :3, 3] @ state.X[:3, :3].T)
    for k in range(6):
        by_shared[np.arange(N), k, lens_terms + 6 + 6 * problem.placements + k] = -1.0
    by_shared[:, :3, -1] = (turn @ state.Ts_head_target[:, :3, 3:])[:, :, 0]
    return residual, by_shot / sigmas[:, None], by_shared / sigmas[:, None]


def _reduced(blocks: _Blocks, damping: float) -> tuple[Floats, Floats, Floats]:
    """Normal matrix and gradient of the shared unknowns, and the shots' inverse blocks."""
    H_ss, H_tt, H_ts, g_s, g_t = blocks
    H_ss = H_ss + damping * np.diag(np.diag(H_ss))
    inverse_tt = np.asarray(np.linalg.inv(H_tt * (1.0 + damping * np.eye(6))), dtype=np.float64)
    eliminated = np.swapaxes(H_ts, 1, 2) @ inverse_tt
    return H_ss - np.einsum("nij,njk->ik", eliminated, H_ts), g_s - np.einsum("nij,nj->i", eliminated, g_t), inverse_tt


def _solved(blocks: _Blocks, damping: float) -> tuple[Floats, Floats]:
    """Steps of the shared unknowns and of the shots' poses ``(N, 6)``."""
    H, g, inverse_tt = _reduced(blocks, damping)
    shared = np.asarray(-np.linalg.lstsq(H, g, rcond=1e-14)[0], dtype=np.float64)
    return shared, -(inverse_tt @ (blocks[4] + blocks[2] @ shared)[:, :, None])[:, :, 0]


def _stepped(state: _State, data: _Data, shared: Floats, shots: Floats) -> _State:
    lens = state.lens.copy()
    n = int(np.count_nonzero(data.free))
    lens[data.free] += shared[:n]
    placements = shared[n + 6 : -1].reshape(-1, 6)
    return _State(
        lens,
        apply_motion(state.X, shared[n : n + 6]),
        state.scale + float(shared[-1]),
        apply_motion(state.Ts_base_target, placements),
        apply_motion(state.Ts_head_target, shots),
    )
