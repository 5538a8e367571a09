"""Numerics that never heard of a robot."""

from sixthlink.solvers.qpso import Qpso, SwarmBudget, contraction

__all__ = ["Qpso", "SwarmBudget", "contraction"]
