"""How does each robot maker write an orientation?

Data, not code: a convention is a kind of numbers and, for angles, a SciPy axis sequence (upper case turns about the
moving axes, lower case about the fixed ones). Sources: the integrators' tables of Mech-Mind and Vathos as compared
in the project's dependency study; KUKA and FANUC were confirmed against each other (KUKA's A, B, C are FANUC's W, P,
R read backwards). Angles come in the angle unit that the recording declares.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from sixthlink.geometry.arrays import Floats

__all__ = ["ORIENTATIONS", "Orientation", "rotations_from_values", "values_from_rotations"]

QUATERNION_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's length from 1 that is taken for rounding."""


@dataclass(frozen=True)
class Orientation:
    """One way of writing an orientation.

    Attributes:
        kind: ``quaternion``, ``rotation vector``, ``matrix`` or ``angles``.
        fields: Names of its numbers, in the order in which they are written; they name the columns of a table.
        sequence: SciPy axis sequence for ``angles``, ``wxyz`` or ``xyzw`` for quaternions, otherwise empty.
        note: What a reader has to know.
    """

    kind: str
    fields: tuple[str, ...]
    sequence: str = ""
    note: str = ""

    @property
    def is_angle(self) -> bool:
        """Whether the numbers carry the angle unit of the file."""
        return self.kind in {"angles", "rotation vector"}


def _euler_orders() -> dict[str, Orientation]:
    """All 24 orders as ``euler-XYZ`` (moving axes) and ``euler-xyz`` (fixed axes)."""
    letters = [p for p in product("xyz", repeat=3) if p[0] != p[1] and p[1] != p[2]]
    orders = {"".join(p) for p in letters} | {"".join(p) for p in permutations("xyz")}
    return {
        f"euler-{seq}": Orientation("angles", ("r1", "r2", "r3"), seq)
        for order in sorted(orders)
        for seq in (order, order.upper())
    }


ORIENTATIONS: dict[str, Orientation] = {
    "quaternion-wxyz": Orientation("quaternion", ("qw", "qx", "qy", "qz"), "wxyz"),
    "quaternion-xyzw": Orientation("quaternion", ("qx", "qy", "qz", "qw"), "xyzw"),
    "rotation-vector": Orientation("rotation vector", ("rx", "ry", "rz"), note="axis times angle"),
    "matrix": Orientation("matrix", tuple(f"r{i}{j}" for i in "123" for j in "123"), note="row by row"),
    "abb": Orientation("quaternion", ("q1", "q2", "q3", "q4"), "wxyz", "ABB robtarget, scalar first"),
    "abb-angles": Orientation("angles", ("rz", "ry", "rx"), "ZYX", "ABB's EulerZYX"),
    "kuka": Orientation("angles", ("a", "b", "c"), "ZYX", "KUKA A, B, C"),
    "fanuc": Orientation("angles", ("w", "p", "r"), "xyz", "FANUC W, P, R"),
    "yaskawa": Orientation("angles", ("rx", "ry", "rz"), "xyz", "Yaskawa Rx, Ry, Rz"),
    "ur": Orientation("rotation vector", ("rx", "ry", "rz"), note="Universal Robots' rotation vector"),
    "staubli": Orientation("angles", ("rx", "ry", "rz"), "XYZ", "Stäubli rx, ry, rz"),
    "kawasaki": Orientation("angles", ("o", "a", "t"), "ZYZ", "Kawasaki O, A, T"),
    **_euler_orders(),
}
"""Every convention a recording may name."""


def rotations_from_values(orientation: Orientation, values: Floats) -> Floats:
    """Rotation matrices of orientations as a maker writes them.

    Args:
        orientation: The convention.
        values: ``(N, len(orientation.fields))`` numbers; angles and rotation vectors in radians.

    Returns:
        ``(N, 3, 3)`` rotation matrices.

    Raises:
        ValueError: A quaternion is not of unit length, or a matrix is sheared, scaled or mirrored.
    """
    from scipy.spatial.transform import Rotation

    v = np.asarray(values, dtype=np.float64).reshape(-1, len(orientation.fields))
    if orientation.kind == "quaternion":
        lengths = np.linalg.norm(v, axis=1)
        worst = int(np.argmax(np.abs(lengths - 1.0))) if len(v) else 0
        if len(v) and abs(lengths[worst] - 1.0) > QUATERNION_TOLERANCE:
            raise ValueError(f"quaternion of row {worst + 1} has length {lengths[worst]:.6g}, expected 1")
        return Rotation.from_quat(v, scalar_first=orientation.sequence == "wxyz").as_matrix()
    if orientation.kind == "rotation vector":
        return Rotation.from_rotvec(v).as_matrix()
    if orientation.kind == "matrix":
        from sixthlink.geometry.transforms import checked_transforms, transform

        return checked_transforms(transform(v.reshape(-1, 3, 3), np.zeros(3)), "matrix")[:, :3, :3]
    return Rotation.from_euler(orientation.sequence, v).as_matrix()


def values_from_rotations(orientation: Orientation, rotations: Floats) -> Floats:
    """Orientations as a maker writes them: the inverse of :func:`rotations_from_values`.

    At gimbal lock, where infinitely many angle triples name the same rotation, the third angle is zero.

    Args:
        orientation: The convention.
        rotations: ``(N, 3, 3)`` rotation matrices.

    Returns:
        ``(N, len(orientation.fields))`` numbers; angles in radians.
    """
    import warnings

    from scipy.spatial.transform import Rotation

    R = Rotation.from_matrix(np.asarray(rotations, dtype=np.float64).reshape(-1, 3, 3))
    if orientation.kind == "quaternion":
        return R.as_quat(canonical=True, scalar_first=orientation.sequence == "wxyz")
    if orientation.kind == "rotation vector":
        return R.as_rotvec()
    if orientation.kind == "matrix":
        return R.as_matrix().reshape(-1, 9)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        return R.as_euler(orientation.sequence)  # type: ignore[call-overload]  # the stubs want a literal
