"""By what factor does a lens move a point along its radius, and how does that factor follow r² and the lens terms?

Of a pinhole lens, with r the tangent of the angle to the axis,

    q = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)

and of a fisheye, with θ = arctan r,

    q = θ / r (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)
"""

from __future__ import annotations

import numpy as np

from sixthlink.geometry import Floats

__all__ = ["fisheye_by_terms", "fisheye_factor", "pinhole_by_terms", "pinhole_factor"]

NARROW = 1e-8
"""Below this r² the ratio of angle and tangent is its series."""


def pinhole_factor(terms: Floats, r2: Floats) -> tuple[Floats, Floats]:
    """The factor q and its derivative by r², from k1, k2, k3, k4, k5, k6."""
    k1, k2, k3, k4, k5, k6 = terms
    top, bottom = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)), 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    rising, falling = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3), k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6)
    q = top / bottom
    return q, (rising - q * falling) / bottom


def pinhole_by_terms(terms: Floats, r2: Floats, q: Floats) -> tuple[Floats, ...]:
    """Derivatives of the factor q by k1, k2, k3, k4, k5, k6."""
    _, _, _, k4, k5, k6 = terms
    share = 1.0 / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    rising = (share * r2, share * r2 * r2, share * r2**3)
    return (*rising, *(-q * power for power in rising))


def fisheye_factor(terms: Floats, r2: Floats) -> tuple[Floats, Floats]:
    """The factor q and its derivative by r², from k1, k2, k3, k4."""
    k1, k2, k3, k4 = terms
    share, t2 = _share_and_angle(r2)
    by_r2 = np.where(r2 < NARROW, -1.0 / 3.0, (1.0 / (1.0 + r2) - share) / (2.0 * np.maximum(r2, NARROW)))
    bent = 1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))
    rising = k1 + t2 * (2.0 * k2 + t2 * (3.0 * k3 + t2 * 4.0 * k4))
    return share * bent, by_r2 * bent + share * share * rising / (1.0 + r2)


def fisheye_by_terms(r2: Floats) -> tuple[Floats, ...]:
    """Derivatives of the factor q by k1, k2, k3, k4."""
    share, t2 = _share_and_angle(r2)
    return share * t2, share * t2 * t2, share * t2**3, share * t2**4


def _share_and_angle(r2: Floats) -> tuple[Floats, Floats]:
    """θ / r and θ²."""
    theta = np.arctan(np.sqrt(r2))
    share = np.where(r2 < NARROW, 1.0 - r2 / 3.0, theta / np.sqrt(np.maximum(r2, NARROW)))
    return share, theta * theta
