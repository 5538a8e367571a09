"""What does the tracker see while one joint turns?

Points of one or several reflectors that sit on the moving side, with the angles of the joint and the points' own
covariances where they are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints, frozen_floats, frozen_ints

__all__ = ["Sweep", "subset", "sweep_of"]

ROUNDING = 1e-13
"""Share of the largest coordinate below which differences are rounding."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """The points of one joint sweep, in the tracker's frame.

    Attributes:
        points_m: ``(N, 3)`` measured points [m].
        reflectors: ``(N,)`` index of the reflector of each point.
        names: Names of the reflectors; every one has a point.
        angles_rad: ``(N,)`` angle of the swept joint [rad], or None.
        covariances_m2: ``(N, 3, 3)`` stated covariance of each point [m²], or None where the noise is not known.
    """

    points_m: Floats
    reflectors: Ints
    names: tuple[str, ...]
    angles_rad: Floats | None = None
    covariances_m2: Floats | None = None

    def __post_init__(self) -> None:
        points = frozen_floats(self.points_m, (None, 3), "points of a sweep")
        N = len(points)
        object.__setattr__(self, "points_m", points)
        object.__setattr__(self, "reflectors", frozen_ints(self.reflectors, (N,), "reflectors of a sweep"))
        if set(self.reflectors.tolist()) != set(range(len(self.names))):
            raise ValueError(
                f"reflectors of a sweep are {len(self.names)} by name, and not all or others by the points"
            )
        if self.angles_rad is not None:
            object.__setattr__(self, "angles_rad", frozen_floats(self.angles_rad, (N,), "angles of a sweep"))
        if self.covariances_m2 is not None:
            covariances = frozen_floats(self.covariances_m2, (N, 3, 3), "covariances of a sweep")
            if N and not (np.linalg.eigvalsh(covariances)[:, 0] > 0.0).all():
                raise ValueError("a covariance of a sweep is not positive definite")
            object.__setattr__(self, "covariances_m2", covariances)

    @property
    def rounding_m(self) -> float:
        """Length below which differences between coordinates are rounding [m]."""
        return ROUNDING * float(np.abs(self.points_m).max(initial=0.0)) + np.finfo(np.float64).tiny


def sweep_of(
    points_m: npt.ArrayLike,
    *,
    angles_rad: npt.ArrayLike | None = None,
    reflectors: Sequence[str] | None = None,
    noise_m: float | None = None,
    covariances_m2: npt.ArrayLike | None = None,
) -> Sweep:
    """A sweep from plain lists.

    Args:
        points_m: ``(N, 3)`` points [m].
        angles_rad: ``(N,)`` angle of the swept joint [rad].
        reflectors: Name of the reflector of each point; one reflector where there are none.
        noise_m: Standard deviation of every coordinate [m]; instead of covariances.
        covariances_m2: ``(N, 3, 3)`` covariance of each point [m²].

    Raises:
        ValueError: Shapes differ, a number is not finite, or the noise is stated twice or is not positive.
    """
    points = np.array(points_m, dtype=np.float64)
    labels = ["reflector"] * len(points) if reflectors is None else list(reflectors)
    names = tuple(dict.fromkeys(labels))
    index = np.array([names.index(label) for label in labels], dtype=np.int64)
    angles = None if angles_rad is None else np.array(angles_rad, dtype=np.float64)
    covariances = None if covariances_m2 is None else np.array(covariances_m2, dtype=np.float64)
    if noise_m is not None:
        if covariances is not None:
            raise ValueError("the noise of a sweep is stated twice: noise_m and covariances_m2")
        if not noise_m > 0.0:
            raise ValueError(f"noise_m is {noise_m}, expected a positive length")
        covariances = np.tile(noise_m**2 * np.eye(3), (len(points), 1, 1))
    return Sweep(points, index, names, angles, covariances)


def subset(sweep: Sweep, chosen: npt.NDArray[np.bool_], reflectors: Ints | None = None) -> Sweep:
    """The chosen points ``(N,)``; reflectors that lose all their points are dropped.

    Args:
        sweep: The sweep.
        chosen: ``(N,)`` which points.
        reflectors: ``(N,)`` other indices to tell the reflectors apart, named by their numbers.
    """
    labels = sweep.reflectors if reflectors is None else reflectors
    present, index = np.unique(labels[chosen], return_inverse=True)
    names = tuple(sweep.names[k] if reflectors is None else str(k + 1) for k in present.tolist())
    return Sweep(
        sweep.points_m[chosen],
        index,
        names,
        None if sweep.angles_rad is None else sweep.angles_rad[chosen],
        None if sweep.covariances_m2 is None else sweep.covariances_m2[chosen],
    )
