"""Numerics that never heard of a robot."""

from sixthlink.solvers.elimination import Equations, Reduced, covariance_of_own, own_steps, reduced, triangle
from sixthlink.solvers.qpso import Qpso, SwarmBudget, contraction

__all__ = [
    "Equations",
    "Qpso",
    "Reduced",
    "SwarmBudget",
    "contraction",
    "covariance_of_own",
    "own_steps",
    "reduced",
    "triangle",
]
