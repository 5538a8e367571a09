"""Where does the instrument stand, and where are the reflectors on their links, under an arm that is taken as exact?

Linear with a free matrix in place of the instrument's rotation, so that no guess is needed; weighed by 1/distance, so
that wrong points do not drag it along. The free matrix also tells what a rotation cannot be: a wrong unit of length
stretches it, a left-handed frame mirrors it. Where the points are too few for a free matrix, turns of a cube are tried
and the best is refined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from sixthlink.calibrate.observations import MeasuredPoints, MeasuredPoses, carrier_poses
from sixthlink.geometry import Floats, Ints, exp_rotation, hat, nearest_rotation, transform
from sixthlink.robot import Arm

__all__ = ["MOST", "Standing", "standing"]

MOST_POINTS = 3000
"""Points that are asked, evenly over all; a start needs no more."""

ROUNDS, TURNS = 15, 30
MOST = 0.85
"""Share of the points by which an arm is judged: a median would believe what only one pose of the sweeps says."""

WELL_SEEN = 1e-4
"""Smallest singular value of the scaled linear system, over its largest, from which its answer is believed."""

NEAREST = 1e-2
"""Distance in medians below which a point weighs no more than others: 1/distance must not let one point rule."""


@dataclass(frozen=True, eq=False)
class Standing:
    """A first place of instrument and reflectors.

    Attributes:
        reflectors_m: ``(r, 3)`` reflectors in the frame of the link that carries each [m].
        Rs_link_reflector: ``(r, 3, 3)`` their orientations there; the identity where none was measured.
        Ts_base_instrument: ``(B, 4, 4)`` where the instrument stands, station by station.
        most_m: Distance from where the arm carries them that ``MOST`` of the points keep [m].
        free_most_m: The same with free matrices in place of rotations [m]; infinite where the points do not show
            them.
        stretch: ``(B, 3)`` singular values of the free matrices, 1 for rotations; None where the points do not show
            them.
        mirrored: Whether the free matrices change the handedness.
    """

    reflectors_m: Floats
    Rs_link_reflector: Floats
    Ts_base_instrument: Floats
    most_m: float
    free_most_m: float
    stretch: Floats | None
    mirrored: bool


def standing(arm: Arm, seen: Sequence[MeasuredPoints]) -> Standing:
    """Place instrument and reflectors.

    Args:
        arm: The arm, taken as exact.
        seen: Kinds of measurements that share stations and reflectors; at least one point in all.
    """
    points = np.concatenate([m.points_m for m in seen])
    Ts_base_link = np.concatenate([carrier_poses(arm, m) for m in seen])
    stations, reflectors = (np.concatenate([getattr(m, name) for m in seen]) for name in ("stations", "reflectors"))
    asked = np.unique(np.linspace(0, len(points) - 1, min(len(points), MOST_POINTS)).round().astype(np.int64))
    rows = _Rows(points[asked], Ts_base_link[asked], stations[asked], reflectors[asked])
    free, free_most_m = _free(rows)
    starts = [nearest_rotation(free)] if free is not None else list(_cube_turns(rows.B))
    answers = [_settled(rows, R) for R in starts]
    best = min(answers, key=lambda a: a.most_m)
    R = best.Ts_base_instrument
    turned = np.tile(np.eye(3), (rows.r, 1, 1))
    for m in seen:
        if isinstance(m, MeasuredPoses):
            turned = _orientations(arm, m, R, turned)
    return Standing(
        best.reflectors_m,
        turned,
        best.Ts_base_instrument,
        best.most_m,
        free_most_m,
        None if free is None else np.asarray(np.linalg.svd(free, compute_uv=False), dtype=np.float64),
        free is not None and bool((np.linalg.det(free) < 0.0).any()),
    )


@dataclass(frozen=True, eq=False)
class _Rows:
    points_m: Floats
    Ts_base_link: Floats
    stations: Ints
    reflectors: Ints

    @property
    def B(self) -> int:
        return int(self.stations.max()) + 1

    @property
    def r(self) -> int:
        return int(self.reflectors.max()) + 1

    def by_reflector(self) -> Floats:
        """``(N, 3, 3r)`` how the reflectors' places move the points in the base frame."""
        N = len(self.points_m)
        rows = np.zeros((N, 3, 3 * self.r))
        for k in range(3):
            rows[np.arange(N), :, 3 * self.reflectors + k] = self.Ts_base_link[:, :3, k]
        return rows

    def by_station(self) -> Floats:
        """``(N, 3, 3B)`` how the stations' positions move the points, minus one to one."""
        N = len(self.points_m)
        rows = np.zeros((N, 3, 3 * self.B))
        for k in range(3):
            rows[np.arange(N), k, 3 * self.stations + k] = -1.0
        return rows


@dataclass(frozen=True, eq=False)
class _Placed:
    reflectors_m: Floats
    Ts_base_instrument: Floats
    most_m: float


def _free(rows: _Rows) -> tuple[Floats | None, float]:
    """Free matrices ``(B, 3, 3)`` from instrument to base, None where not shown, and the distance that most keep."""
    N, B, r = len(rows.points_m), rows.B, rows.r
    by_matrix = np.zeros((N, 3, 9 * B))
    for k in range(3):
        for i in range(3):
            by_matrix[np.arange(N), k, 9 * rows.stations + 3 * k + i] = -rows.points_m[:, i]
    A = np.concatenate([rows.by_reflector(), rows.by_station(), by_matrix], axis=2)
    right = -rows.Ts_base_link[:, :3, 3]
    found = _least_distances(A, right)
    if found is None:
        return None, np.inf
    return found[3 * (r + B) :].reshape(B, 3, 3), float(np.quantile(np.linalg.norm(A @ found - right, axis=1), MOST))


def _least_distances(A: Floats, right: Floats) -> Floats | None:
    """X with the least sum of distances |A x - right|; None where x is not determined."""
    N, _, unknowns = A.shape
    if unknowns + 3 > 3 * N:
        return None
    sizes = np.maximum(np.linalg.norm(A.reshape(-1, unknowns), axis=0), np.finfo(np.float64).tiny)
    scaled, weights = A / sizes, np.ones(N)
    for _ in range(ROUNDS):
        root = np.sqrt(weights)[:, None]
        U, s, Vt = np.linalg.svd((scaled * root[:, :, None]).reshape(3 * N, unknowns), full_matrices=False)
        if s[-1] < WELL_SEEN * s[0]:
            return None
        x = Vt.T @ ((U.T @ (right * root).ravel()) / s)
        weights = _weights(np.linalg.norm(scaled @ x - right, axis=1))
    return np.asarray(x / sizes, dtype=np.float64)


def _settled(rows: _Rows, R: Floats) -> _Placed:
    """Rotations ``(B, 3, 3)``, positions and reflectors by Gauss-Newton with the same weights."""
    N, B, r = len(rows.points_m), rows.B, rows.r
    A = np.concatenate([rows.by_reflector(), rows.by_station(), np.zeros((N, 3, 3 * B))], axis=2)
    weights, x, R = np.ones(N), np.zeros(3 * (r + B)), R.copy()
    for _ in range(TURNS):
        turned = np.einsum("nij,nj->ni", R[rows.stations], rows.points_m)
        right = turned - rows.Ts_base_link[:, :3, 3]
        across = hat(turned)
        for k in range(3):
            A[np.arange(N), :, 3 * (r + B + rows.stations) + k] = across[:, :, k]
        root = np.sqrt(weights)[:, None]
        step = np.linalg.lstsq((A * root[:, :, None]).reshape(3 * N, -1), (right * root).ravel(), rcond=1e-9)[0]
        x, turns = step[: 3 * (r + B)], step[3 * (r + B) :].reshape(B, 3)
        weights = _weights(np.linalg.norm((A[:, :, : 3 * (r + B)] @ x) - right, axis=1))
        R = exp_rotation(turns) @ R
    turned = np.einsum("nij,nj->ni", R[rows.stations], rows.points_m)
    off = np.linalg.norm(A[:, :, : 3 * (r + B)] @ x - (turned - rows.Ts_base_link[:, :3, 3]), axis=1)
    return _Placed(x[: 3 * r].reshape(r, 3), transform(R, x[3 * r :].reshape(B, 3)), float(np.quantile(off, MOST)))


def _weights(distances_m: Floats) -> Floats:
    floor = max(NEAREST * float(np.median(distances_m)), 1e-12)
    return 1.0 / np.maximum(distances_m, floor)


def _cube_turns(B: int) -> list[Floats]:
    """The 24 turns of a cube, for every station alike."""
    turns = []
    for order in permutations(range(3)):
        for signs in product((-1.0, 1.0), repeat=3):
            R = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(R) > 0.0:
                turns.append(np.tile(R, (B, 1, 1)))
    return turns


def _orientations(arm: Arm, m: MeasuredPoses, Ts_base_instrument: Floats, turned: Floats) -> Floats:
    """Orientation of every probe on its link: the median of what its measurements say, entry by entry."""
    R_base_link = carrier_poses(arm, m)[:, :3, :3]
    said = np.swapaxes(R_base_link, 1, 2) @ Ts_base_instrument[m.stations, :3, :3] @ m.rotations
    turned = turned.copy()
    for k in np.unique(m.reflectors).tolist():
        turned[k] = nearest_rotation(np.median(said[m.reflectors == k], axis=0))
    return turned
