"""What would a laser tracker have written while the simulated arm swept its joints, and what is true in it?

One joint after the other moves over an arc, then come free poses; reflectors on the ground are measured before every
sweep. The reflector of a sweep rides on the flange; where a joint drives another by a coupling, one on the driver's own
link is measured too, as the paper says. The tracker measures a range and two angles from the origin of its frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints, exp_rotation, frozen_floats, inverse, transform, transform_points
from sixthlink.recording import ReferencePoints, Reflector, Sweep, TrackerRecord
from sixthlink.robot import Arm
from sixthlink.simulate.kinematics import Chain, chain_link_poses, chain_of_arm
from sixthlink.simulate.manufacture import built_arm
from sixthlink.simulate.scenario import Scenario, stream
from sixthlink.units import DEG, MM

__all__ = ["SimulatedTracking", "TrackerSession", "TrackerTruth", "simulate_tracking"]

HIGHEST_SHARE = 0.92
"""Part of a joint's range that free poses use."""

LOWEST_M = 0.05
"""Height over the floor below which no reflector is taken."""


@dataclass(frozen=True)
class TrackerSession:
    """Numbers of a session with a laser tracker.

    Attributes:
        range_sigma_m: Noise of a measured range [m].
        angle_sigma_rad: Noise of each measured angle [rad]; 7.5 µrad are 0.02 mm at 2.7 m.
        stops: Points of each sweep.
        arc_rad: Arc of each sweep, as far as the joint's range allows [rad].
        home_rad: Joint values between the sweeps [rad]; missing ones are 0.
        free_points: Poses all over the joint ranges.
        flange_reflectors_m: Reflectors in the flange's frame; the first is that of the sweeps [m].
        driver_reflector_m: Reflector on the link of a joint that drives another, in that link's frame [m].
        T_base_tracker: Where the tracker stands: x, y, z [m] and a turn about the vertical [rad].
        nests_m: Reflectors on the ground, in the base frame [m].
        drift_m: How far the tracker's stand shifts, along its x, between the sweeps named next [m].
        drift_before: Index of the sweep before which it shifts; the free points are the last.
        outliers: Points that are wrong.
        outlier_m: By how much [m].
    """

    range_sigma_m: float = 0.02 * MM
    angle_sigma_rad: float = 7.5e-6
    stops: int = 30
    arc_rad: float = 120.0 * DEG
    home_rad: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 60.0 * DEG, 0.0)
    free_points: int = 60
    flange_reflectors_m: tuple[tuple[float, float, float], ...] = ((0.16, 0.05, 0.2),)
    driver_reflector_m: tuple[float, float, float] = (-0.1, 0.15, 0.2)
    T_base_tracker: tuple[float, float, float, float] = (2.6, -0.9, 0.9, 2.5)
    nests_m: tuple[tuple[float, float, float], ...] = ((1.4, 1.0, 0.1), (1.2, -1.3, 0.1), (1.9, 0.2, 0.05))
    drift_m: float = 0.0
    drift_before: int = 0
    outliers: int = 0
    outlier_m: float = 5.0 * MM


@dataclass(frozen=True, eq=False)
class TrackerTruth:
    """What a calibration from the tracker's points should find.

    Attributes:
        arm: The arm as it was built.
        T_base_tracker: ``(4, 4)`` where the tracker stood at first.
        reflectors_m: Place of each reflector: in its link's frame, or in the base frame on the ground [m].
        axes: ``(J, 3)`` directions of the joints' axes in the tracker's frame, in the pose of their sweeps.
        outliers: ``(K,)`` indices of the points that are wrong.
    """

    arm: Arm
    T_base_tracker: Floats
    reflectors_m: dict[str, tuple[float, float, float]]
    axes: Floats
    outliers: Ints

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_base_tracker", frozen_floats(self.T_base_tracker, (4, 4), "T_base_tracker"))
        object.__setattr__(self, "axes", frozen_floats(self.axes, (len(self.arm.joints), 3), "axes"))

    def seen_at(self, joints: npt.ArrayLike, reflector: str, link: int) -> Floats:
        """Where the tracker would see a reflector ``(N, 3)`` without any noise [m]."""
        Ts_base_link = chain_link_poses(chain_of_arm(self.arm), np.asarray(joints, dtype=np.float64), link)
        points = transform_points(Ts_base_link, np.tile(self.reflectors_m[reflector], (len(Ts_base_link), 1)))
        return transform_points(inverse(self.T_base_tracker), points)


@dataclass(frozen=True, eq=False)
class SimulatedTracking:
    """A tracker record with its truth."""

    record: TrackerRecord
    truth: TrackerTruth


def simulate_tracking(scenario: Scenario, session: TrackerSession, nominal_arm: Arm, *, seed: int) -> SimulatedTracking:
    """Simulate a session at the same arm that :func:`~.cell.simulate_cell` builds from this seed.

    Args:
        scenario: The arm's errors and its repeatability.
        session: What the tracker does.
        nominal_arm: The arm as its maker draws it: a DH table of turning joints.
        seed: Seed of everything random.

    Raises:
        ValueError: The arm is no DH table of turning joints.
    """
    if not nominal_arm.turns[list(nominal_arm.own_steps)].all():
        raise ValueError(f"arm {nominal_arm.name} has sliding joints, whose reflectors draw no circles")
    arm = built_arm(scenario, nominal_arm, stream(seed, "arm"))
    random = stream(seed, "tracker")
    J = len(arm.joints)
    x, y, z, yaw = session.T_base_tracker
    T_base_tracker = transform(exp_rotation(np.array([0.0, 0.0, yaw])), [x, y, z])
    reflectors = _reflectors(session, nominal_arm)
    stops = _stops(session, nominal_arm, chain_of_arm(nominal_arm), random)
    joints = np.concatenate([q for q, _ in stops])
    sweep_of = np.repeat(np.arange(len(stops)), [len(q) for q, _ in stops])
    reflector_of = np.concatenate([names for _, names in stops])
    stop_of = np.unique(np.column_stack([sweep_of, joints]), axis=0, return_inverse=True)[1].ravel()
    # The arm stands still while two reflectors are measured at one stop.
    erred = joints + scenario.joint_repeatability_rad * random.standard_normal((int(stop_of.max()) + 1, J))[stop_of]
    truth = TrackerTruth(
        arm,
        T_base_tracker,
        {r.name: place for r, place in reflectors},
        _axes(session, arm, T_base_tracker),
        np.sort(random.choice(len(joints), session.outliers, replace=False)).astype(np.int64),
    )
    exact = np.empty((len(joints), 3))
    for k, (reflector, _) in enumerate(reflectors):
        mine = reflector_of == k
        if mine.any():
            exact[mine] = truth.seen_at(erred[mine], reflector.name, reflector.link)
    drift = np.where(sweep_of >= session.drift_before, session.drift_m, 0.0)
    exact[:, 0] -= drift
    wrong = random.standard_normal((session.outliers, 3))
    exact[truth.outliers] += session.outlier_m * wrong / np.linalg.norm(wrong, axis=1, keepdims=True)
    points, covariances = _measured(session, exact, random)
    sweeps = (*(Sweep(f"A{j + 1}", j) for j in range(J)), *((Sweep("free", None),) if session.free_points else ()))
    record = TrackerRecord(
        name=f"simulated tracker, scenario {scenario.name}, seed {seed}",
        instrument="simulated laser tracker",
        robot=nominal_arm.name,
        arm=nominal_arm,
        sweeps=sweeps,
        reflectors=tuple(r for r, _ in reflectors),
        points=points,
        names=tuple(f"{sweeps[s].name}_{k + 1}" for k, s in enumerate(sweep_of.tolist())),
        sweep_of=sweep_of,
        reflector_of=reflector_of,
        joints=joints,
        joints_known=np.ones(joints.shape, dtype=np.bool_),
        covariances=covariances,
        references=_references(session, truth, reflectors, sweep_of, random),
    )
    return SimulatedTracking(record, truth)


def _drivers(arm: Arm) -> dict[int, int]:
    """Joints that drive another by a coupling, and the first that they drive, from 0."""
    drivers: dict[int, int] = {}
    for follower, step in reversed(list(enumerate(arm.own_steps))):
        drivers |= {j: follower for j in np.flatnonzero(arm.joint_map[step]).tolist() if j != follower}
    return drivers


def _reflectors(session: TrackerSession, arm: Arm) -> list[tuple[Reflector, tuple[float, float, float]]]:
    J = len(arm.joints)
    found = [(Reflector(f"R{k + 1}", J), place) for k, place in enumerate(session.flange_reflectors_m)]
    found += [(Reflector(f"L{j + 1}", j + 1), session.driver_reflector_m) for j in sorted(_drivers(arm))]
    return found + [(Reflector(f"N{k + 1}", 0), place) for k, place in enumerate(session.nests_m)]


def _stops(session: TrackerSession, arm: Arm, chain: Chain, random: np.random.Generator) -> list[tuple[Floats, Ints]]:
    """Per sweep the joint values of its points and the reflectors that were measured; the free poses last."""
    J, flange = len(arm.joints), len(session.flange_reflectors_m)
    home = np.zeros(J)
    home[: len(session.home_rad)] = session.home_rad[:J]
    drivers, found = sorted(_drivers(arm)), []
    for j in range(J):
        low, high = arm.limits[j]
        middle, half = 0.5 * (low + high), 0.5 * min(session.arc_rad, high - low)
        q = np.tile(home, (session.stops, 1))
        q[:, j] = middle + np.linspace(-half, half, session.stops)
        seen = [0, flange + drivers.index(j)] if j in drivers else [0]
        found.append((np.repeat(q, len(seen), axis=0), np.tile(seen, session.stops)))
    if session.free_points:
        q = _free_poses(session, arm, chain, random)
        found.append((np.repeat(q, flange, axis=0), np.tile(np.arange(flange), len(q))))
    return found


def _free_poses(session: TrackerSession, arm: Arm, chain: Chain, random: np.random.Generator) -> Floats:
    """Poses all over the joint ranges, with the flange above the floor."""
    spare = 0.5 * (1.0 - HIGHEST_SHARE) * np.diff(arm.limits, axis=1)[:, 0]
    q = random.uniform(arm.limits[:, 0] + spare, arm.limits[:, 1] - spare, (50 * session.free_points, len(arm.joints)))
    high = chain_link_poses(chain, q, len(arm.joints))[:, 2, 3] > LOWEST_M
    if np.count_nonzero(high) < session.free_points:
        raise ValueError(f"arm {arm.name} hardly comes above its own foot: there are no free poses")
    return q[high][: session.free_points]


def _axes(session: TrackerSession, arm: Arm, T_base_tracker: Floats) -> Floats:
    """Directions ``(J, 3)`` about which the reflector turns by the right hand as each joint's value grows."""
    J, chain = len(arm.joints), chain_of_arm(arm)
    home = np.zeros((1, J))
    home[0, : len(session.home_rad)] = session.home_rad[:J]
    axes = np.empty((J, 3))
    for j, step in enumerate(arm.own_steps):
        before, after = home.copy(), home.copy()
        before[0, j], after[0, j] = -0.1, 0.1
        R = [chain_link_poses(chain, q, j + 1)[0, :3, :3] for q in (before, after)]
        turn = R[1] @ R[0].T
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        axes[j] = axis / np.linalg.norm(axis) if arm.turns[step] else 0.0
    return axes @ T_base_tracker[:3, :3]


def _measured(session: TrackerSession, exact: Floats, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Points with the noise of range and angles, and their covariances."""
    distances = np.linalg.norm(exact, axis=1)
    sights = exact / distances[:, None]
    along = sights[:, :, None] * sights[:, None, :]
    across = np.eye(3) - along
    noise = random.standard_normal((2, len(exact), 3))
    ranged = np.einsum("nij,nj->ni", along, noise[0]) * session.range_sigma_m
    turned = np.einsum("nij,nj->ni", across, noise[1]) * (session.angle_sigma_rad * distances)[:, None]
    variances = (session.angle_sigma_rad * distances)[:, None, None] ** 2
    return exact + ranged + turned, session.range_sigma_m**2 * along + variances * across


def _references(
    session: TrackerSession,
    truth: TrackerTruth,
    reflectors: list[tuple[Reflector, tuple[float, float, float]]],
    sweep_of: Ints,
    random: np.random.Generator,
) -> ReferencePoints | None:
    """The nests, measured before every sweep and at the end."""
    nests = [k for k, (reflector, _) in enumerate(reflectors) if reflector.link == 0]
    if not nests:
        return None
    starts = np.append(np.searchsorted(sweep_of, np.unique(sweep_of)), len(sweep_of))
    rounds, K = len(starts), len(nests)
    places = transform_points(inverse(truth.T_base_tracker), np.array([reflectors[k][1] for k in nests]))
    exact = np.tile(places, (rounds, 1))
    moved = np.repeat(np.arange(rounds), K) >= session.drift_before
    exact[:, 0] -= np.where(moved, session.drift_m, 0.0)
    points, covariances = _measured(session, exact, random)
    return ReferencePoints(np.tile(nests, rounds), points, np.repeat(starts, K), covariances)
