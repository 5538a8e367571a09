"""Do the points fit the arm at all, and if not: which simple mistake explains it?

Under the nominal arm, taken as exact, the points lie off by what its tolerances make. Where they are off by far more,
every simple mistake is tried: a wrong unit of length, a left-handed frame, joint columns exchanged, counted backwards,
from another zero or a row too early or late, a coupling that the arm's file does not have. The one that makes the
points fit is named.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import combinations

import numpy as np

from sixthlink.calibrate.arm import link_parameters
from sixthlink.calibrate.joint import MOST, JointData, Standing, standing
from sixthlink.calibrate.observations import Columns, JointState, MeasuredPoints
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats
from sixthlink.robot import Arm
from sixthlink.units import DEG, MM

__all__ = ["EXPLAINS", "expected_most_m", "refuse_contradictions"]

DOUBTFUL = 4.0
"""Multiple of what the tolerances make, from which the points do not fit the arm."""

EXPLAINS = 0.2
"""Share of the deviations that an explanation may leave."""

ALIKE = 1.05
"""Ratio below which two explanations explain alike: a wrist that counts backwards is one turned by 180°."""

UNITS = {
    0.001: "metres, where millimetres were declared",
    1000.0: "millimetres, where metres were declared",
    25.4: "millimetres, where inches were declared",
    1.0 / 25.4: "inches, where millimetres were declared",
    0.0254: "metres, where inches were declared",
    1.0 / 0.0254: "inches, where metres were declared",
    10.0: "millimetres, where centimetres were declared",
    0.1: "centimetres, where millimetres were declared",
    0.01: "metres, where centimetres were declared",
    100.0: "centimetres, where metres were declared",
}
UNIT_TOLERANCE, SMALLEST_STRETCH = 0.02, 0.03

OFFSETS_RAD = (90.0 * DEG, -90.0 * DEG, 180.0 * DEG)


def refuse_contradictions(data: JointData, found: Standing) -> bool:
    """Raise where one simple mistake explains why the points do not fit the arm.

    Args:
        data: The points and the nominal arm.
        found: Where tracker and reflectors are under that arm.

    Returns:
        Whether the points fit the arm as well as its tolerances let one expect.

    Raises:
        CalibrationError: A mistake explains the deviations; the message says which and what to do.
    """
    expected = expected_most_m(data, found)
    if found.most_m <= DOUBTFUL * expected:
        return True
    off = f"under the nominal arm the points are off by up to {found.most_m / MM:.3g} mm ({MOST:.0%} of them), "
    off += f"{expected / MM:.2g} mm expected"
    stretched = _stretched(found, expected)
    if stretched:
        raise CalibrationError(f"{off}: {stretched}")
    tried = [(standing(arm, seen).most_m, words) for arm, seen, words in _mistakes(data.arm, data.outside)]
    best = min(left for left, _ in tried)
    if best <= EXPLAINS * found.most_m and best <= DOUBTFUL * expected:
        words = "; or ".join(words for left, words in tried if left < ALIKE * best)
        raise CalibrationError(f"{off}: {words}. Then {best / MM:.3g} mm are left")
    return False


def expected_most_m(data: JointData, found: Standing) -> float:
    """Deviation that most points keep if the arm is as good as its tolerances [m]."""
    links = link_parameters(data.arm)
    sigmas = np.array([p.sigma for p in links])
    columns = Columns(head=False, reflectors=tuple("r" * len(found.reflectors_m)), arm=links)
    state = JointState(
        data.arm,
        reflectors_m=found.reflectors_m,
        Rs_link_reflector=found.Rs_link_reflector,
        Ts_base_instrument=found.Ts_base_instrument,
    )
    spreads = []
    for seen in data.outside:
        by_arm = seen.linearised(state, columns).shared[:, :3, columns.arm_slice] * sigmas
        spreads.append(np.sqrt(np.sum(by_arm**2, axis=(1, 2))))
    return float(np.quantile(np.concatenate(spreads), MOST))


def _stretched(found: Standing, expected_m: float) -> str:
    """A wrong unit or a left-handed frame, where a free matrix makes the points fit and a rotation does not."""
    if found.stretch is None or found.free_most_m > max(EXPLAINS * found.most_m, DOUBTFUL * expected_m):
        return ""
    scale = float(np.mean(found.stretch))
    if found.mirrored:
        return (
            "they fit when mirrored: the tracker's frame is left-handed, or two of its columns are exchanged; correct "
            "columns x, y, z, or the sign of one, in the tables"
        )
    if abs(scale - 1.0) < SMALLEST_STRETCH:
        return ""
    # The free matrix carries the points to the arm: it is small where the points are too large.
    factor = 1.0 / scale
    unit = next((words for f, words in UNITS.items() if abs(factor / f - 1.0) < UNIT_TOLERANCE), "")
    cure = f": they look like {unit}" if unit else ""
    return (
        f"all distances between them are {factor:.4g} times those of the arm{cure}; correct units.length of "
        "tracker.yaml or of the table, or the unit of the arm's file"
    )


def _mistakes(arm: Arm, seen: tuple[MeasuredPoints, ...]) -> Iterator[tuple[Arm, tuple[MeasuredPoints, ...], str]]:
    """Every simple mistake undone, and what to say of it."""
    J = len(arm.joints)
    for a, b in combinations(range(J), 2):
        order = list(range(J))
        order[a], order[b] = b, a
        words = (
            f"they fit when the columns of {arm.joints[a]} and {arm.joints[b]} change places (correct columns.joints)"
        )
        yield arm, _with(seen, partial(np.take, indices=order, axis=1)), words
    for j in range(J):
        signs = np.where(np.arange(J) == j, -1.0, 1.0)
        words = f"they fit when {arm.joints[j]} counts backwards (correct its direction in the arm's file)"
        yield arm, _with(seen, signs.__mul__), words
        if not arm.turns[arm.own_steps[j]]:
            continue
        for offset in OFFSETS_RAD:
            shift = np.where(np.arange(J) == j, offset, 0.0)
            words = (
                f"they fit when {arm.joints[j]} counts from another zero, {offset / DEG:+.0f}° away (correct theta of "
                "the arm's file)"
            )
            yield arm, _with(seen, shift.__add__), words
    for step, word in ((1, "one row later"), (-1, "one row earlier")):
        words = f"they fit when every point has the joints of {word} (pair points and joints again)"
        yield arm, _with(seen, partial(np.roll, shift=-step, axis=0)), words
    yield from _couplings(arm, seen)


def _couplings(arm: Arm, seen: tuple[MeasuredPoints, ...]) -> Iterator[tuple[Arm, tuple[MeasuredPoints, ...], str]]:
    """Neighbouring joints that drive each other one to one, or do not although the arm's file says so."""
    own = arm.own_steps
    for j in range(len(own) - 1):
        if not (arm.turns[own[j]] and arm.turns[own[j + 1]]):
            continue
        present = float(arm.joint_map[own[j + 1], j])
        for factor in (-1.0, 0.0, 1.0):
            if abs(factor - present) < 0.5:
                continue
            joint_map = arm.joint_map.copy()
            joint_map[own[j + 1], j] = factor
            driver, follower = arm.joints[j], arm.joints[j + 1]
            says = (
                f"a coupling of {follower} to {driver} with factor {factor:+g}"
                if factor
                else (f"no coupling of {follower} to {driver}")
            )
            yield replace(arm, joint_map=joint_map), seen, f"they fit with {says} (correct couplings of the arm's file)"


def _with(seen: tuple[MeasuredPoints, ...], change: Callable[[Floats], Floats]) -> tuple[MeasuredPoints, ...]:
    return tuple(replace(m, joints=change(m.joints)) for m in seen)
