"""What must a calibration answer with yes before it is accepted?"""

from __future__ import annotations

import math

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.head import GAP_TOLERANCE, Certificate, Scatter
from sixthlink.calibrate.heldout_error import HeldOut
from sixthlink.calibrate.joint import JointEvidence
from sixthlink.units import DEG, MM

__all__ = ["agreement_gate", "gates_of", "heldout_gate", "noise_gate", "used_gate"]

MINIMUM_USED_SHARE = 0.5
"""Share of the calibration shots that must have been usable for the result to be accepted."""


LARGEST_SCATTER_M, LARGEST_SCATTER_RAD = 0.03, 5.0 * DEG
"""No robot with a right description leaves more: uncalibrated arms leave some 10 mm and half a degree."""

LARGEST_HELDOUT_RATIO = 4.0
"""Unseen shots are off by somewhat more than fitted ones; this much more means that the fit has learnt its shots."""

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


def agreement_gate(scatter: Scatter) -> Gate:
    """Whether the shots agree at all: beyond this it is not noise, but something paired or described wrongly."""
    position, turn = scatter.rms_translation_m, scatter.rms_rotation_rad
    return _gate(
        "the shots agree",
        position <= LARGEST_SCATTER_M and turn <= LARGEST_SCATTER_RAD,
        f"the target scatters by {position / MM:.3g} mm and {turn / DEG:.2g}° (RMS), at most "
        f"{LARGEST_SCATTER_M / MM:g} mm and {LARGEST_SCATTER_RAD / DEG:g}° are accepted",
        "look for rows shifted against each other, a wrong unit of length, joint sign or order, mount or direction",
    )


def heldout_gate(heldout: HeldOut, fitted: Scatter) -> Gate:
    """Whether shots that were kept out fit about as well as those that made the answer."""
    ratio = max(
        heldout.rms_translation_m / max(fitted.rms_translation_m, 1e-9),
        heldout.rms_rotation_rad / max(fitted.rms_rotation_rad, 1e-9),
    )
    return _gate(
        "unseen shots agree",
        ratio <= LARGEST_HELDOUT_RATIO,
        f"the {heldout.shots} held-out shots are off by {heldout.rms_translation_m / MM:.3g} mm and "
        f"{heldout.rms_rotation_rad / DEG:.2g}°, {ratio:.1f} times as much as the fitted ones, at most "
        f"{LARGEST_HELDOUT_RATIO:g} times is accepted",
        "too few shots, or too much alike, for what was estimated: record more, with other poses",
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
