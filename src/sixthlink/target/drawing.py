"""What is printed on a target's sheet?

Black and white rectangles along the target's axes, then discs, painted in this order: enough for every kind, for the
printer as for the simulator.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, frozen_floats

__all__ = ["Drawing"]

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Drawing:
    """A printed sheet in the target's frame.

    Attributes:
        paper: ``(4,)`` least x, least y, largest x, largest y of the white sheet that belongs to the target [m].
        rectangles: ``(R, 4)`` the same four of each rectangle, later ones over earlier ones [m].
        black: ``(R,)`` whether each rectangle is black; all by default.
        discs: ``(D, 3)`` centre x, y and radius of each black disc, over all rectangles; none touch [m].
    """

    paper: Floats
    rectangles: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    black: Bools | None = None
    discs: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        object.__setattr__(self, "paper", frozen_floats(self.paper, (4,), "paper"))
        object.__setattr__(self, "rectangles", frozen_floats(self.rectangles, (None, 4), "rectangles"))
        object.__setattr__(self, "discs", frozen_floats(self.discs, (None, 3), "discs"))
        R = len(self.rectangles)
        black = np.ones(R, dtype=np.bool_) if self.black is None else np.array(self.black, dtype=np.bool_)
        if black.shape != (R,):
            raise ValueError(f"black has shape {black.shape}, expected ({R},)")
        black.flags.writeable = False
        object.__setattr__(self, "black", black)
