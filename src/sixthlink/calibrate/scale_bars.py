"""Do the scale bars and the target agree about what a metre is?

A certificate with a typing error would pull arm and head to its own metre, and verification with the same standard
would agree. Without the certified distances, arm and head predict them with an uncertainty of their own: what the
distances add to the sum of squares must be what chance adds.
"""

from __future__ import annotations

from dataclasses import replace

from scipy.stats import chi2

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.joint import Estimate, JointData, solve
from sixthlink.calibrate.observations import SocketDistances

__all__ = ["scale_gates"]

CHANCE = 1e-6
"""Chance that agreeing bars and target are called contradictory."""


def scale_gates(data: JointData, found: Estimate) -> tuple[Gate, ...]:
    """Whether certified distances and target agree; no gate without bars."""
    if data.certificate is None:
        return ()
    kinds = tuple(o for o in found.problem.observations if not isinstance(o, SocketDistances))
    without = replace(found.problem, observations=kinds)
    alone = solve(without, found.fit.state, found.scales, {0: found.kept[0].astype(float)}).cost
    places = len(data.certificate.places)
    added, limit = found.fit.cost - alone, float(chi2.isf(CHANCE, places))
    figure = (
        f"the {places} certified distances add {added:.1f} to the sum of squares, where chance adds {places}; at most "
        f"{limit:.0f} is accepted"
    )
    cure = "the standard's certified length, the target's size or a unit is wrong: measure both again"
    passed = added <= limit
    return (Gate("scale bars and target agree", passed, figure if passed else f"{figure}; {cure}"),)
