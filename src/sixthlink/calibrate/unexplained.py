"""What is wrong with the pixels beyond the noise that the detector states?

Boards are bent and misprinted, robots shake, a lens is not quite what its model is. What the residuals show beyond the
stated noise σ is taken to be one size u for all pixels, independent of how sharply each was seen:

    Σ r² / (σ² + u²) = degrees of freedom

Weighed by σ alone, the sharpest views would outweigh the others by more than they know.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, refine_rig
from sixthlink.geometry import Floats

__all__ = ["unexplained_px", "weighed"]


def weighed(problem: RigProblem, fit: RigFit, stated_px: Floats) -> tuple[RigProblem, RigFit]:
    """The problem with what its best explanation leaves unexplained in all deviations, and the answer to that.

    Args:
        problem: Observations.
        fit: Their best explanation.
        stated_px: ``(M,)`` standard deviation of each coordinate, as the detector states it [pixel].
    """
    more_px = unexplained_px(fit, stated_px)
    problem = replace(problem, sigmas_px=np.hypot(stated_px, more_px))
    return problem, refine_rig(problem, fit.rig, fit.Ts_head_target)


def unexplained_px(fit: RigFit, stated_px: Floats) -> float:
    """Standard deviation of a coordinate beyond the stated one [pixel]; 0 where that says it all."""
    from scipy.optimize import brentq

    squares = np.sum(fit.residuals_px**2, axis=1)
    freedom = float(squares.sum()) / fit.noise_px**2 if fit.noise_px > 0.0 else 0.0

    def excess(more_px: float) -> float:
        return float(np.sum(squares / (stated_px**2 + more_px**2))) - freedom

    if freedom == 0.0 or excess(0.0) <= 0.0:
        return 0.0
    return float(brentq(excess, 0.0, 2.0 * fit.noise_px))
