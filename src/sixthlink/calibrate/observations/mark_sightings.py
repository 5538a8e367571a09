"""A mark that stands still while the head looks at it from several poses: what does it say about head and arm?

Whatever the pose, the mark is where it is; its position is an unknown of its own. The marks of a length standard add
their certified distance (:class:`~.fixed_points.SocketDistances`). With one pose per mark nothing but that distance is
left, so that this holds everything that a length alone would say.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sixthlink.calibrate.observations.known_lengths import carried_points
from sixthlink.calibrate.observations.linearised import Linearised
from sixthlink.calibrate.observations.state import Columns, JointState
from sixthlink.geometry import Floats, Ints

__all__ = ["MarkSightings"]


@dataclass(frozen=True, eq=False)
class MarkSightings:
    """N sightings of marks, m marks to a place.

    Attributes:
        joints: ``(N, J)`` joint values [rad or m].
        points_head: ``(N, 3)`` mark in the head frame [m].
        covariances: ``(N, 3, 3)`` of those points, from the pixels [m²].
        places: ``(N,)`` number of the place.
        marks: ``(N,)`` which mark of the place, 0 to m - 1.
        repeatability_rad: ``(J,)`` standard deviation of every joint that counts as scale 1 [rad or m].
        by_lens: ``(N, 3, g)`` motion of the points per unit of the cameras' free unknowns.
        fixed_head: Whether the head stands still and the marks ride on the flange.
    """

    joints: Floats
    points_head: Floats
    covariances: Floats
    places: Ints
    marks: Ints
    repeatability_rad: Floats
    by_lens: Floats = field(default_factory=lambda: np.zeros((0, 3, 0)))
    fixed_head: bool = False
    block: str = "marks"

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(N, 3)`` [m] in the axes of the frame in which the marks stand, and derivatives."""
        points, shared, by_joint, R_head = carried_points(self, state, columns)
        N, m = len(self.joints), state.marks_m.shape[1]
        own = np.zeros((N, 3, 3 * m))
        for k in range(3):
            own[np.arange(N), k, 3 * self.marks + k] = -1.0
        J = by_joint * self.repeatability_rad
        noises = {
            "joints": J @ np.swapaxes(J, 1, 2),
            "pixels": R_head @ self.covariances @ np.swapaxes(R_head, 1, 2),
        }
        residuals = points - state.marks_m[self.places, self.marks]
        return Linearised(residuals, shared, own, self.places, noises)
