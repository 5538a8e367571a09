"""What is studied: which cells, how often, under which noise, and what is done wrong on purpose?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

from sixthlink.simulate import Scenario

__all__ = ["CONTROLS", "NOISES", "SOURCES", "Study", "grid"]

NOISES = ("known", "estimated")
"""Whether the size of the joints' noise is told, or found from the residuals."""

CONTROLS = ("none", "weights-wrong-by-two", "unwhitened")
"""What is done wrong on purpose, so that the checks prove that they can fail."""

SOURCES = ("poses", "pixels")
"""What a trial begins with: target poses with the noise that pixels give them, or the pixels themselves."""


@dataclass(frozen=True)
class Study:
    """Many simulated recordings of one or more cells.

    Attributes:
        scenarios: The cells, one per point of the grid.
        trials: Recordings per cell.
        seed: Seed of everything random.
        noise: One of ``NOISES``.
        control: One of ``CONTROLS``.
        source: One of ``SOURCES``.
    """

    scenarios: tuple[Scenario, ...]
    trials: int
    seed: int = 0
    noise: str = "known"
    control: str = "none"
    source: str = "poses"

    def __post_init__(self) -> None:
        for value, legal in ((self.noise, NOISES), (self.control, CONTROLS), (self.source, SOURCES)):
            if value not in legal:
                raise ValueError(f"{value!r} is none of {', '.join(legal)}")
        if not self.scenarios or self.trials < 1:
            raise ValueError("a study needs at least one cell and one trial")


def grid(
    scenario: Scenario,
    *,
    poses: Sequence[int] = (),
    placements: Sequence[int] = (),
    pixel_noises_px: Sequence[float] = (),
    joint_repeatabilities_rad: Sequence[float] = (),
) -> tuple[Scenario, ...]:
    """Every combination of some numbers of a scenario; what is not named stays as it is."""
    choices = product(
        poses or (scenario.poses,),
        placements or (scenario.placements,),
        pixel_noises_px or (scenario.pixel_noise_px,),
        joint_repeatabilities_rad or (scenario.joint_repeatability_rad,),
    )
    return tuple(
        replace(scenario, poses=v, placements=p, pixel_noise_px=noise, joint_repeatability_rad=joints)
        for v, p, noise, joints in choices
    )
