"""Which way round was a target that looks the same after a turn?

A board whose ends look alike can be read from either end, a square one from any of four sides. The robot knows: between
two shots of one placement the camera must turn by the same angle as the flange, whatever the head is. Each pair of
shots votes for the number of turns between their readings that fits best, the louder the worse the next one fits. The
votes as complex numbers, a turn being the K-th root of one, make a Hermitian matrix; the phases of its leading
eigenvector are the joint verdict (angular synchronisation, Singer 2011). For K = 2 the matrix is real and the phases
are signs. An angle of 90° could be a quarter turn forwards or backwards: such a pair is silent.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.head.problem import HeadProblem
from sixthlink.geometry import Floats, Ints, nearest_rotation, rotation_angle, transform
from sixthlink.recording import Detections
from sixthlink.target import turn_names

__all__ = ["readings", "renamed", "turn_transforms"]

VOTERS = 60
"""Shots of a placement that vote about every other shot; enough for a clear verdict, and linear in the shots."""


def turn_transforms(points_m: Floats, turn: Ints | None) -> Floats:
    """``Ts_target_renamed`` ``(K, 4, 4)``: ``T_a_target`` becomes ``T_a_target @ T`` when names are turned k times."""
    Ts = []
    for name in turn_names(turn, len(points_m)):
        named = points_m[name]
        here, there = named - named.mean(axis=0), points_m - points_m.mean(axis=0)
        covariance = there.T @ here
        covariance[2, 2] += np.linalg.norm(covariance)  # a plane leaves its normal's sign open: keep it
        R = nearest_rotation(covariance)
        Ts.append(transform(R, points_m.mean(axis=0) - R @ named.mean(axis=0)))
    return np.stack(Ts)


def renamed(detections: Detections, shots: Ints, turns: Ints, names: Ints) -> Detections:
    """The detections with the names in some shots turned.

    Args:
        detections: What was seen.
        shots: ``(N,)`` index of each of these shots.
        turns: ``(N,)`` turns of each.
        names: ``(K, P)`` as :func:`~sixthlink.target.turn_names` gives them.
    """
    of_shot = np.zeros(max(int(detections.shots.max(initial=-1)), int(shots.max(initial=-1))) + 1, dtype=np.int64)
    of_shot[shots] = turns
    return replace(detections, points=names[of_shot[detections.shots], detections.points])


def readings(problem: HeadProblem, Ts_target_renamed: Floats) -> Ints:
    """``(N,)`` turns by which the names of each shot must be turned to be those of most shots of its placement."""
    K = len(Ts_target_renamed)
    turns = np.zeros(len(problem.placements), dtype=np.int64)
    for p in range(int(problem.placements.max()) + 1) if K > 1 else ():
        members = np.flatnonzero(problem.placements == p)
        voters = members[np.linspace(0, len(members) - 1, min(len(members), VOTERS)).round().astype(np.int64)]
        votes = _votes(problem, members, voters, Ts_target_renamed[:, :3, :3])
        among = votes[np.searchsorted(members, voters)]
        verdict = np.linalg.eigh(0.5 * (among + among.conj().T))[1][:, -1]
        phase = votes @ verdict
        # The eigenvector's own phase is arbitrary: the K-th powers of all members agree on it.
        common = np.angle(np.sum((phase / np.maximum(np.abs(phase), 1e-300)) ** K)) / K
        turned = np.rint((np.angle(phase) - common) * K / (2.0 * np.pi)).astype(np.int64) % K
        most = int(np.argmax(np.bincount(turned, minlength=K)))
        turns[members] = (turned - most) % K
    return turns


def _votes(problem: HeadProblem, members: Ints, voters: Ints, Rs: Floats) -> npt.NDArray[np.complex128]:
    """``(n, v)`` complex votes about how many turns a member needs more than a voter."""
    outer, inner = problem.Ts_outer[:, :3, :3], problem.Ts_inner[:, :3, :3]
    robot = rotation_angle(np.swapaxes(outer[members], 1, 2)[:, None] @ outer[voters][None])
    seen = [rotation_angle((inner[members] @ R)[:, None] @ np.swapaxes(inner[voters], 1, 2)[None]) for R in Rs]
    misses = np.abs(np.stack(seen) - robot)
    best, next_best = np.partition(misses, 1, axis=0)[:2]
    return (next_best - best) * np.exp(2j * np.pi * np.argmin(misses, axis=0) / len(Rs))
