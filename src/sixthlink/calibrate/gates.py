"""What must a calibration answer with yes before it is accepted?"""

from __future__ import annotations

import math

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.head import GAP_TOLERANCE, Certificate
from sixthlink.calibrate.joint import JointEvidence

__all__ = ["gates_of", "noise_gate", "used_gate"]

MINIMUM_USED_SHARE = 0.5
"""Share of the calibration shots that must have been usable for the result to be accepted."""


LARGEST_NOISE_RATIO = 20.0
"""Beyond this multiple of the stated repeatability it is not noise that the model leaves, but a wrong model."""

JOINT_ERRORS = ("joints", "socket", "pose")
"""Origins of the noise that are errors of joints."""


def gates_of(recorded: int, used: int, certificate: Certificate) -> tuple[Gate, ...]:
    """The gates of a calibration with ``used`` of ``recorded`` shots."""
    return (
        used_gate(recorded, used),
        _gate(
            "proven minimum",
            certificate.certified,
            f"eq. (11) is within {certificate.relative_gap:.1e} of its proven lower bound, at most "
            f"{GAP_TOLERANCE:.0e} is accepted",
            "more swarms or iterations help, or shots with less noise",
        ),
    )


def used_gate(recorded: int, used: int) -> Gate:
    """Whether most calibration shots could be used."""
    return _gate(
        "enough shots used",
        used >= MINIMUM_USED_SHARE * recorded,
        f"{used} of {recorded} calibration shots were usable, at least {MINIMUM_USED_SHARE:.0%} are needed",
        "the rejections say what to change",
    )


def noise_gate(evidence: JointEvidence) -> Gate:
    """Whether the model explains the data: the joints may scatter more than stated, but not beyond reason."""
    sizes = {n.origin: n.size for n in evidence.noise}
    stated = next((n.stated for n in evidence.noise if n.origin == "joints"), None)
    ratio = math.hypot(*(sizes.get(origin, 0.0) for origin in JOINT_ERRORS)) / stated if stated else 1.0
    return _gate(
        "model explains the data",
        ratio <= LARGEST_NOISE_RATIO,
        f"χ² per degree of freedom {evidence.chi2_per_dof:.2f} under the stated noise; the joints scatter {ratio:.2f} "
        f"times what the robot's file states, at most {LARGEST_NOISE_RATIO:.0f} times is accepted"
        + ("; the intervals are as wide as that noise makes them" if ratio > 1.0 else ""),
        "check the robot's kinematics, the joint order and units, the target's size, and that the robot stood still",
    )


def _gate(name: str, passed: bool, figure: str, cure: str) -> Gate:
    """A gate whose message carries the cure only where one is needed."""
    return Gate(name, passed, figure if passed else f"{figure}; {cure}")
