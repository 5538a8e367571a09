"""Touches of sockets with known truth: the ball is brought to each socket from many different poses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sixthlink.calibrate.arm import arm_motions, arm_with_steps, link_parameters
from sixthlink.calibrate.observations import carried
from sixthlink.files import load_arm
from sixthlink.robot import Arm, flange_poses

TOOL_M = np.array([0.01, -0.02, 0.14])
LENGTH_M = 0.05


@dataclass(frozen=True, eq=False)
class Touched:
    nominal: Arm
    true: Arm
    joints: np.ndarray
    places: np.ndarray
    points: np.ndarray
    points_m: np.ndarray


def touched(
    rng: np.random.Generator,
    *,
    places: int = 2,
    points: int = 2,
    each: int = 20,
    contact_m: float = 0.0,
    share: float = 1.0,
    errors=lambda q, sockets: 0.0,
) -> Touched:
    """A Panda whose links are off by ``share`` of their tolerances; ``errors`` are those of the joints [rad]."""
    nominal = load_arm("franka_panda", folder=Path())
    links = link_parameters(nominal)
    sigmas = np.array([p.sigma for p in links])
    true = arm_with_steps(nominal, links, share * sigmas * rng.standard_normal(len(links)))
    middle = np.array([0.0, 0.5, 0.0, -1.8, 0.0, 2.3, 0.0])
    place = np.repeat(np.arange(places), points * each)
    point = np.tile(np.repeat(np.arange(points), each), places)
    homes = middle + np.linspace(-0.7, 0.7, places)[:, None] * np.eye(7)[0]
    corners = LENGTH_M * np.array([[0, 0, 0], [0, 1.0, 0], [0.8, 0.5, 0], [0.3, 0.2, 1.0]])[:points]
    origins = flange_poses(true, homes)[:, :3, 3] + np.array([0, 0, -0.14])
    points_m = origins[:, None] + corners
    q = homes[place] + rng.uniform(-0.7, 0.7, (len(place), 7))
    error = np.broadcast_to(errors(q, place * points + point), q.shape)
    goal = points_m[place, point] + contact_m * rng.standard_normal((len(q), 3))
    for _ in range(12):
        Ts, _, by_joint = arm_motions(true, q + error, ())
        levers = Ts[:, :3, :3] @ TOOL_M
        J = carried(levers)[:, :3] @ by_joint
        off = levers + Ts[:, :3, 3] - goal
        step = (np.linalg.pinv(J) @ off[:, :, None])[:, :, 0]
        q = q - np.clip(step, -0.3, 0.3)
    return Touched(nominal, true, q, place, point, points_m)
