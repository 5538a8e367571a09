"""Which head do the classic closed forms for AX = XB find, and where do ours differ from the textbook?

A and B are the motions of flange and head between two shots of a placement, X = T_flange_head, and the
methods differ in what they make linear. Ours differ from the usual programs in four things (reasons:
:mod:`~.loops`):

- The work is linear in the shots. All pairs are summed in one pass (Horaud, Andreff, Daniilidis), or pairs
  are chosen, at most ``PARTNERS`` per shot (Tsai, Park, whose rotation vectors exist only pair by pair).
- The signs of quaternions are settled before anything is added, so that half turns do no harm. Small motions
  need no threshold: each equation here shrinks with its motion, so that an uninformative pair has no weight.
- Where turns and shifts share a system, lengths are divided by one taken from the data, so that millimetres
  and metres give the same head.
- Rotations that turn lengths stand between what the robot and what the head says, as far towards either as the
  shots show it to be the better witness.

With that, Tsai, Park, Horaud and Shah minimise nearly the same sum and agree to second order in the noise;
Andreff and Li, which become one and the same, and Daniilidis also use the shifts for the rotation.

Every method takes ``Ts_base_flange`` ``(N, 4, 4)`` [m], ``Ts_head_target`` ``(N, 4, 4)`` [m] and
``placements`` ``(N,)`` (equal integers share a target placement) and returns X ``(4, 4)`` [m]. It raises
``ValueError`` for a wrong shape or a value that is not finite, ``TooFewShotsError`` for fewer than two
motions, and ``DegenerateMotionError`` where the motion leaves a direction of the head unseen: such shots are
refused, never answered.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sixthlink.calibrate.head.loops import (
    Loops,
    balanced_length,
    flange_rotations,
    head_loops,
    head_with_rotation,
)
from sixthlink.calibrate.head.placement_sums import centred, triangular, without_nuisance
from sixthlink.calibrate.head.quaternions import (
    conjugate,
    left_products,
    quaternions_from_rotations,
    right_products,
    rotation_from_quaternion,
)
from sixthlink.calibrate.head.robot_world import joint_rotation, li, shah
from sixthlink.geometry import Floats, Ints, hat, nearest_rotation

__all__ = ["CLOSED_FORMS", "andreff", "daniilidis", "horaud", "park", "tsai"]

PARTNERS = 40
"""Motions that one shot takes part in; up to 41 shots of a placement these are all pairs."""


def tsai(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Floats:
    """Head ``(4, 4)`` by Tsai and Lenz.

    With P = 2 sin(θ/2) n for each motion, (P_A + P_B) × p = P_B - P_A is linear in p = tan(θ_X/2) n_X. That
    is infinite for a head mounted at half a turn, so the equation is posed about the first rotation, where p
    is small and the answer does not depend on the choice of the head's axes.

    Source: R. Y. Tsai, R. K. Lenz, "A new technique for fully autonomous and efficient 3D robotics hand/eye
    calibration", IEEE Transactions on Robotics and Automation 5 (1989) 345-358, eq. (12), (14), (15).
    """
    loops = head_loops(Ts_base_flange, Ts_head_target, placements)
    A, B = _motion_quaternions(loops)
    P_A, P_B = 2.0 * A[:, 1:], 2.0 * B[:, 1:] @ loops.rotation_head.T
    p = np.linalg.lstsq(hat(P_A + P_B).reshape(-1, 3), (P_B - P_A).reshape(-1))[0]
    turn = rotation_from_quaternion(np.concatenate([[1.0], p]))
    return head_with_rotation(loops, turn @ loops.rotation_head)


def park(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Floats:
    """Head ``(4, 4)`` by Park and Martin.

    The rotation vectors of each motion obey log A = R_X log B, and the best R_X is the orthogonal factor of
    the sum of their products. A rotation vector's noise grows with its angle as θ/2 over sin(θ/2): each pair
    weighs by the inverse square.

    Source: F. C. Park, B. J. Martin, "Robot sensor calibration: solving AX = XB on the Euclidean group", IEEE
    Transactions on Robotics and Automation 10 (1994) 717-721.
    """
    loops = head_loops(Ts_base_flange, Ts_head_target, placements)
    A, B = _motion_quaternions(loops)
    a, b = _rotation_vectors(A), _rotation_vectors(B)
    half_angle = 0.25 * (np.linalg.norm(a, axis=1) + np.linalg.norm(b, axis=1))
    weights = np.sinc(half_angle / np.pi) ** 2
    return head_with_rotation(loops, nearest_rotation(np.einsum("n,ni,nj->ij", weights, a, b)))


def horaud(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Floats:
    """Head ``(4, 4)`` by Horaud and Dornaika.

    In unit quaternions a x = x b is linear in x, and the x of unit length with the smallest sum of squares is
    an eigenvector of a 4×4 matrix. The sum over all pairs is that of the products g_i x c_i about their mean.

    Source: R. Horaud, F. Dornaika, "Hand-eye calibration", International Journal of Robotics Research 14
    (1995) 195-210, the separate solution.
    """
    loops = head_loops(Ts_base_flange, Ts_head_target, placements)
    g, c = _aligned_quaternions(loops)
    rows = centred(left_products(g) @ right_products(c), loops.placements).reshape(-1, 4)
    return head_with_rotation(loops, rotation_from_quaternion(_smallest(rows)[-1]))


def andreff(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Floats:
    """Head ``(4, 4)`` by Andreff, Horaud and Espiau.

    The nine entries of R_X and the translation solve one linear system, rotations by Kronecker products, so
    that shifts help to find the rotation; it needs no angle, axis or sign. Turns and shifts weigh by the
    balanced length, the rotation is put on the group and the translation found again for it. Summed over all
    pairs and with the shares of robot and head, that is the system of Li.

    Source: N. Andreff, R. Horaud, B. Espiau, "On-line hand-eye calibration", 3-D Digital Imaging and Modeling
    (1999) 430-436.
    """
    loops = head_loops(Ts_base_flange, Ts_head_target, placements)
    return head_with_rotation(loops, joint_rotation(loops))


def daniilidis(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Floats:
    """Head ``(4, 4)`` by Daniilidis' dual quaternions.

    A motion of the flange and that of the head are screws of the same angle and pitch, and a x = x b in dual
    quaternions is linear in the eight numbers of x; two singular vectors vanish, and x is their combination
    with a unit real part. The base's origin is put at the target, where noise in a turn disturbs the dual
    rows least, lengths are divided by the balanced length, and the translation is found again.

    Source: K. Daniilidis, "Hand-eye calibration using dual quaternions", International Journal of Robotics
    Research 18 (1999) 286-298.
    """
    loops = head_loops(Ts_base_flange, Ts_head_target, placements)
    first = head_with_rotation(loops, loops.rotation_head)
    length_m = balanced_length(loops, first)
    g, c = _aligned_quaternions(loops)
    turned, mounted = flange_rotations(loops, loops.rotation_head)
    sights = loops.target_positions_m @ first[:3, :3].T
    arms = (turned @ sights[..., None])[..., 0] + mounted @ first[:3, 3]
    # With the target as origin, the flange is minus its arm to the target, up to the residual of its shot.
    positions = centred(loops.positions_m + arms, loops.placements) - arms
    m = quaternions_from_rotations(turned)
    m *= np.copysign(1.0, np.sum(m * g, axis=1, keepdims=True))
    after, by_robot, by_head = right_products(c), left_products(g), right_products(conjugate(c))
    # The product m x is (1 - w) g x + w z conj(c): linear in x and in the placement's z, which is eliminated.
    shift = left_products(_pure(positions)) @ after + after @ right_products(_pure(loops.target_positions_m))
    rows, share = np.zeros((len(g), 8, 12)), loops.shares.sight
    rows[:, :4, :4] = -np.eye(4)
    rows[:, :4, 4:8] = by_robot @ after
    rows[:, 4:, :4] = share * shift @ by_head / (2.0 * length_m)
    rows[:, 4:, 4:8] = (1.0 - share) * shift @ by_robot / (2.0 * length_m)
    rows[:, 4:, 8:] = left_products(m) @ after
    rows[:, 4:] = centred(rows[:, 4:], loops.placements)
    null = _smallest(without_nuisance(rows, loops.placements, 4))[-2:]
    # The real parts of both are parallel up to noise; the translation is found again for their direction.
    return head_with_rotation(loops, rotation_from_quaternion(np.linalg.svd(null[:, :4])[2][0]))


CLOSED_FORMS: dict[str, Callable[[Floats, Floats, Ints], Floats]] = {
    "tsai": tsai,
    "park": park,
    "horaud": horaud,
    "andreff": andreff,
    "daniilidis": daniilidis,
    "shah": shah,
    "li": li,
}
"""Every closed form by the name of its author, AX = XB in order of publication, then AX = ZB."""


def _aligned_quaternions(loops: Loops) -> tuple[Floats, Floats]:
    """Quaternions ``(N, 4)`` g of flange and c of target, signed so that g x c is alike in a placement."""
    g, c = quaternions_from_rotations(loops.rotations), quaternions_from_rotations(loops.target_rotations)
    x = quaternions_from_rotations(loops.rotation_head)
    z = left_products(g) @ right_products(c) @ x
    firsts = np.unique(loops.placements, return_index=True)[1]
    signs = np.copysign(1.0, np.sum(z * z[firsts[loops.placements]], axis=1, keepdims=True))
    return g, c * signs


def _motion_quaternions(loops: Loops) -> tuple[Floats, Floats]:
    """Quaternions ``(M, 4)`` of the chosen motions of flange and head, of like sign, angle up to π."""
    g, c = _aligned_quaternions(loops)
    i, j = _pairs(loops)
    A = _product(conjugate(g[j]), g[i])
    B = _product(c[j], conjugate(c[i]))
    signs = np.copysign(1.0, A[:, :1] + B[:, :1])
    return A * signs, B * signs


def _pairs(loops: Loops) -> tuple[Ints, Ints]:
    """Shots i and j of the chosen motions: all pairs of a small placement, some of a large one.

    The shots of a placement stand in a ring, in the order of their distance from its mean position, which
    depends neither on the base frame nor on the order of recording; each is paired with those at the same
    steps ahead.
    """
    first, second = [], []
    for p in range(int(loops.placements.max()) + 1):
        ring = np.flatnonzero(loops.placements == p)
        positions = loops.positions_m[ring]
        ring = ring[np.argsort(np.linalg.norm(positions - positions.mean(axis=0), axis=1), kind="stable")]
        n = len(ring)
        for step in np.unique(np.linspace(1, n // 2, min(n // 2, PARTNERS // 2)).round().astype(np.int64)):
            # Half way round an even ring, every pair would come twice.
            starts = ring[: n // 2] if 2 * step == n else ring
            first.append(starts)
            second.append(np.roll(ring, -step)[: len(starts)])
    return np.concatenate(first), np.concatenate(second)


def _rotation_vectors(quaternions: Floats) -> Floats:
    """Rotation vectors ``(M, 3)`` that keep the sign of their quaternion: past π they go on growing [rad]."""
    sine = np.linalg.norm(quaternions[:, 1:], axis=1, keepdims=True)
    half_angle = np.arctan2(sine, quaternions[:, :1])
    vectors: Floats = 2.0 * half_angle / np.maximum(sine, np.finfo(np.float64).tiny) * quaternions[:, 1:]
    return vectors


def _product(left: Floats, right: Floats) -> Floats:
    return (left_products(left) @ right[..., None])[..., 0]


def _pure(vectors: Floats) -> Floats:
    return np.concatenate([np.zeros((len(vectors), 1)), vectors], axis=1)


def _smallest(rows: Floats) -> Floats:
    """Right singular vectors of tall rows, one a row, the smallest singular value last."""
    return np.linalg.svd(triangular(rows))[2]
