"""Which parameters of the arm can this recording tell apart, and from what can it not tell the others?

The triangular factor of the whitened Jacobian, head, lenses and placements eliminated first, scaled by the maker's
tolerances, is factorised once more with column pivoting: a pivot says how much the data know of a parameter, given
those chosen before it. What has no pivot of its own stays nominal, and the factor says which parameters it repeats.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from sixthlink.calibrate.arm.parameters import ArmParameter
from sixthlink.geometry import Floats

__all__ = ["Visibility", "visibility"]

UNSEEN = 1e-3
"""A pivot below this share of the maker's tolerance is rounding or a direction that nothing in the data moves."""

TIE = 1e-6
"""Advantage of a parameter over the one before it: far below any real difference, far above rounding."""

PARTNER = 0.2
"""Share from which another parameter is named as doing the same."""


@dataclass(frozen=True)
class Visibility:
    """Whether the data see one parameter.

    Attributes:
        seen: Whether it can be estimated.
        knowledge: What the data know of it, given the others chosen before: tolerance over uncertainty [-].
        reason: Why it stays nominal; empty when it is seen.
    """

    seen: bool
    knowledge: float
    reason: str


def visibility(
    factor: Floats, parameters: Sequence[ArmParameter], *, others: str = "the head or the placements"
) -> tuple[Visibility, ...]:
    """Judge parameters by what the data alone know of them.

    Args:
        factor: ``(G, G)`` triangular factor of all shared unknowns, the parameters' columns being its last.
        parameters: The parameters.
        others: What the unknowns before them are, for people.
    """
    A = len(parameters)
    if A == 0:
        return ()
    # Of two that do exactly the same, rounding must not choose: the later one is preferred, as Hayati's d.
    block = factor[-A:, -A:] * np.array([p.sigma for p in parameters]) * (1.0 + TIE * np.arange(A))
    R, order = sla.qr(block, mode="r", pivoting=True, check_finite=False)
    pivots = np.abs(np.diag(R))
    rank = int(np.count_nonzero(pivots > UNSEEN))
    repeats = sla.solve_triangular(R[:rank, :rank], R[:rank, rank:]) if rank else np.zeros((0, A))
    found: dict[int, Visibility] = {}
    for place, a in enumerate(order.tolist()):
        if place < rank:
            found[a] = Visibility(True, float(pivots[place]), "")
        else:
            reason = _reason(parameters, order, repeats[:, place - rank], others)
            found[a] = Visibility(False, float(pivots[place]), reason)
    return tuple(found[a] for a in range(A))


def _reason(parameters: Sequence[ArmParameter], order: Floats, shares: Floats, others: str) -> str:
    partners = [parameters[int(order[k])].name for k in np.flatnonzero(np.abs(shares) > PARTNER)]
    if partners:
        return f"the data cannot tell it from {', '.join(partners)}"
    return f"the data cannot tell it from {others}"
