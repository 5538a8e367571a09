"""How does the head read as the arm's sixth link, and as the paper's six numbers?

The head is estimated as a rigid transform ``T_link5_camera``; these are two ways of *reporting* it. The
paper's eq. (2)-(4) lose signs and take the wrong point for the camera's origin; the signed form here
reproduces every head (``docs/theory/head_as_link.md``):

    T_link5_camera = Rz(θ6) Tz(d6) Tx(a6) Rx(α6) · Rz(φ+γ) Tz(-L)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sixthlink.geometry import Floats, transform

__all__ = [
    "HeadLink",
    "PaperNumbers",
    "head_link_from_transform",
    "paper_numbers_from_transform",
    "transform_from_head_link",
    "transform_from_paper_numbers",
]

PARALLEL_SINE = 1e-9
"""Below this sine of α6 the common normal of Z5 and Z6 is lost in rounding: the axes count as parallel."""

NEARLY_PARALLEL_SINE = math.sin(math.radians(1.0))
"""Below this sine of α6 the link's d6 and L are poorly determined although the head itself is not."""


@dataclass(frozen=True)
class HeadLink:
    """The head as sixth DH link, followed by a turn φ+γ about Z6 and a shift -L along it.

    Attributes:
        theta6_rad: Angle from X5 to X6 about Z5.
        d6_m: Offset along Z5 to the common normal.
        a6_m: Signed length of the common normal along X6.
        alpha6_rad: Angle from Z5 to Z6 about X6, in [0, π].
        phi_gamma_rad: Turn about Z6 that brings X6 to the camera's x axis (the paper's φ + γ).
        L_m: The camera's origin is -L along Z6 from the common normal.
        remark: Empty, or what a reader must know about parallel axes.
    """

    theta6_rad: float
    d6_m: float
    a6_m: float
    alpha6_rad: float
    phi_gamma_rad: float
    L_m: float
    remark: str = ""


@dataclass(frozen=True)
class PaperNumbers:
    """The paper's (α, β, γ, x, y, z): R = Rx(-α) Ry(β) Rz(γ), translation (-x, -y, +z) [rad, m].

    ``remark`` is empty, or says that β is at ±90° where α and γ are not separate.
    """

    alpha_rad: float
    beta_rad: float
    gamma_rad: float
    x_m: float
    y_m: float
    z_m: float
    remark: str = ""


def head_link_from_transform(T_link5_camera: Floats) -> HeadLink:
    """The head as sixth link, signs included.

    With Z6 parallel to Z5 the common normal is not unique. Convention then: L = 0, X6 points from Z5 to Z6
    (along X5 if the axes coincide), and the remark says so.

    Args:
        T_link5_camera: ``(4, 4)`` head.
    """
    R, p = T_link5_camera[:3, :3], T_link5_camera[:3, 3]
    z6 = R[:, 2]
    sine = math.hypot(z6[0], z6[1])
    alpha6 = math.atan2(sine, z6[2])
    if sine < PARALLEL_SINE:
        a6 = math.hypot(p[0], p[1])
        theta6 = math.atan2(p[1], p[0]) if a6 > 0.0 else 0.0
        d6, length = float(p[2]), 0.0
        remark = (
            "Z6 is parallel to Z5: the common normal is not unique, so L = 0 by convention and X6 points "
            "from Z5 to Z6. The head itself is not affected."
        )
    else:
        theta6 = math.atan2(z6[0], -z6[1])
        x6 = np.array([math.cos(theta6), math.sin(theta6), 0.0])
        columns = np.column_stack([np.array([0.0, 0.0, 1.0]), x6, -z6])
        d6, a6, length = (float(v) for v in np.linalg.solve(columns, p))
        remark = ""
        if sine < NEARLY_PARALLEL_SINE:
            remark = (
                f"Z6 is within {math.degrees(math.asin(sine)):.2f}° of Z5: d6, L and θ6 change a lot with "
                "the head's tilt although the head itself is ordinary; prefer the matrix."
            )
    R_link5_link6 = _turn_z(theta6) @ _turn_x(alpha6)
    R_link6_camera = R_link5_link6.T @ R
    phi_gamma = math.atan2(R_link6_camera[1, 0], R_link6_camera[0, 0])
    return HeadLink(theta6, d6, a6, alpha6, phi_gamma, length, remark)


def transform_from_head_link(link: HeadLink) -> Floats:
    """``T_link5_camera`` ``(4, 4)`` of a head given as sixth link (eq. 3 and 5, signed)."""
    R_link5_link6 = _turn_z(link.theta6_rad) @ _turn_x(link.alpha6_rad)
    x6 = np.array([math.cos(link.theta6_rad), math.sin(link.theta6_rad), 0.0])
    p = link.d6_m * np.array([0.0, 0.0, 1.0]) + link.a6_m * x6 - link.L_m * R_link5_link6[:, 2]
    return transform(R_link5_link6 @ _turn_z(link.phi_gamma_rad), p)


def paper_numbers_from_transform(T_link5_camera: Floats) -> PaperNumbers:
    """The paper's six numbers of a head; at β = ±90° γ is 0 by convention and the remark says so."""
    R, p = T_link5_camera[:3, :3], T_link5_camera[:3, 3]
    cosine = math.hypot(R[0, 0], R[0, 1])
    beta = math.atan2(R[0, 2], cosine)
    if cosine < PARALLEL_SINE:
        alpha, gamma = math.atan2(-R[2, 1], R[1, 1]), 0.0
        remark = "β is at ±90°: only a combination of α and γ is defined, so γ = 0 by convention."
    else:
        # R[1, 2] = sin α cos β and R[2, 2] = cos α cos β, since the first turn is about X by -α.
        alpha, gamma = math.atan2(R[1, 2], R[2, 2]), math.atan2(-R[0, 1], R[0, 0])
        remark = ""
    return PaperNumbers(alpha, beta, gamma, -float(p[0]), -float(p[1]), float(p[2]), remark)


def transform_from_paper_numbers(numbers: PaperNumbers) -> Floats:
    """``T_link5_camera`` ``(4, 4)`` = Rx(-α) Ry(β) Rz(γ), translation (-x, -y, +z) (paper, section II.A)."""
    cb, sb = math.cos(numbers.beta_rad), math.sin(numbers.beta_rad)
    turn_y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    R = _turn_x(-numbers.alpha_rad) @ turn_y @ _turn_z(numbers.gamma_rad)
    return transform(R, np.array([-numbers.x_m, -numbers.y_m, numbers.z_m]))


def _turn_x(angle_rad: float) -> Floats:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _turn_z(angle_rad: float) -> Floats:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
