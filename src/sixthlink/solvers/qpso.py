"""How does a quantum-behaved particle swarm search a box?

Source: the paper's eq. (6)-(9).

Ask/tell: the swarms propose positions, the caller judges them, so that it never calls user code, can be stopped at
any moment and is repeatable from its generator. Several independent swarms advance as one array.

What the equations leave open is fixed here: φ, u and the coin are drawn per particle and dimension; u is drawn from
(0, 1]; a position outside the box is put on its wall; an objective value that is not a number counts as the worst.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats

__all__ = ["Qpso", "SwarmBudget", "contraction"]


@dataclass(frozen=True)
class SwarmBudget:
    """How much a search may spend.

    Attributes:
        swarms: Independent swarms S, searching side by side.
        particles: Swarm size M.
        iterations: MAXITER of eq. (9).
    """

    swarms: int = 8
    particles: int = 40
    iterations: int = 1000

    def __post_init__(self) -> None:
        if self.swarms < 1:
            raise ValueError(f"a search needs at least 1 swarm, got {self.swarms}")
        if self.particles < 2:
            raise ValueError(f"a swarm needs at least 2 particles, got {self.particles}")
        if self.iterations < 1:
            raise ValueError(f"a search needs at least 1 iteration, got {self.iterations}")


def contraction(iteration: int, iterations: int) -> float:
    """Contraction-expansion coefficient of eq. (9): from 1.0 down to 0.5."""
    return 0.5 * (iterations - iteration) / iterations + 0.5


class Qpso:
    """Independent swarms in one box. Call :meth:`ask`, judge the positions, :meth:`tell`; repeat until :attr:`done`."""

    def __init__(
        self,
        lower: npt.ArrayLike,
        upper: npt.ArrayLike,
        budget: SwarmBudget,
        rng: np.random.Generator,
    ) -> None:
        """Set up the swarms.

        Args:
            lower: ``(D,)`` lower walls of the box.
            upper: ``(D,)`` upper walls.
            budget: Number of swarms, their size and length.
            rng: Source of chance; the same generator state gives the same search.

        Raises:
            ValueError: The box is empty, reversed or not finite.
        """
        self._lower = np.asarray(lower, dtype=np.float64)
        self._upper = np.asarray(upper, dtype=np.float64)
        if not (np.isfinite(self._lower).all() and np.isfinite(self._upper).all()):
            raise ValueError("the walls of the search box must be finite")
        if self._lower.shape != self._upper.shape or (self._lower >= self._upper).any():
            raise ValueError("every lower wall of the search box must be below its upper wall")
        self._budget = budget
        self._rng = rng
        self._iteration = 0
        shape = (budget.swarms, budget.particles, len(self._lower))
        self._positions = rng.uniform(self._lower, self._upper, shape)
        self._best_positions = self._positions.copy()
        self._best_values = np.full(shape[:2], np.inf)

    @property
    def done(self) -> bool:
        """Whether the budget is spent."""
        return self._iteration > self._budget.iterations

    @property
    def iteration(self) -> int:
        """Times that the swarms have been judged."""
        return self._iteration

    @property
    def best_values(self) -> Floats:
        """``(S,)`` best value of each swarm so far, infinite before the first :meth:`tell`."""
        return self._best_values.min(axis=1)

    @property
    def best_positions(self) -> Floats:
        """``(S, D)`` position of each swarm's best value so far: G of eq. (7)."""
        best = np.argmin(self._best_values, axis=1)
        return self._best_positions[np.arange(len(best)), best]

    def ask(self) -> Floats:
        """Positions ``(S, M, D)`` to judge next: the random start first, then eq. (6)-(8)."""
        if self._iteration > 0:
            self._positions = self._moved()
        return self._positions.copy()

    def tell(self, values: npt.ArrayLike) -> None:
        """Values ``(S, M)`` of the positions last asked for; the smaller the better."""
        judged = np.where(np.isfinite(values), values, np.inf)
        better = judged < self._best_values
        self._best_values[better] = judged[better]
        self._best_positions[better] = self._positions[better]
        self._iteration += 1

    def _moved(self) -> Floats:
        shape = self._positions.shape
        a = contraction(self._iteration - 1, self._budget.iterations)
        phi = self._rng.random(shape)
        u = 1.0 - self._rng.random(shape)
        sign = np.where(self._rng.random(shape) < 0.5, 1.0, -1.0)
        mean_best = self._best_positions.mean(axis=1, keepdims=True)  # eq. (6)
        attractor = phi * self._best_positions + (1.0 - phi) * self.best_positions[:, None]  # eq. (7)
        moved = attractor + sign * a * np.abs(mean_best - self._positions) * np.log(1.0 / u)  # eq. (8)
        return np.clip(moved, self._lower, self._upper)
