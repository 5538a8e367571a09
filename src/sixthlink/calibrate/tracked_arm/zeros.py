"""Would the points fit an arm whose joints count from other zeros: lost mastering, another home position?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sixthlink.calibrate.arm import link_parameters
from sixthlink.calibrate.joint import JointData, estimate
from sixthlink.errors import CalibrationError
from sixthlink.robot import Arm
from sixthlink.units import DEG

__all__ = ["with_other_zeros"]

ANYWHERE_RAD = 1.0
"""Standard deviation that a zero is given when nothing of it is believed."""

NOTABLE_RAD = 0.5 * DEG
"""Change of a zero that is told."""


def with_other_zeros(data: JointData) -> tuple[Arm, str]:
    """The arm with only the zeros of its turning joints estimated, and what changed in words."""
    own = [step for step in data.arm.own_steps if data.arm.turns[step]]
    zeros = [replace(p, sigma=ANYWHERE_RAD) for p in link_parameters(data.arm) if p.step in own]
    try:
        found = estimate(data, parameters=zeros).fit.state.arm
    except CalibrationError:
        return data.arm, ""
    changes = found.values - data.arm.values
    told = [
        f"{data.arm.joints[j]} {changes[step] / DEG:+.3g}°"
        for j, step in enumerate(data.arm.own_steps)
        if step in own and np.abs(changes[step]) > NOTABLE_RAD
    ]
    return found, ", ".join(told)
