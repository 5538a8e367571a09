"""Every maker's way of writing an orientation means one rotation and comes back from it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.geometry import ORIENTATIONS, exp_rotation, rotations_from_values, values_from_rotations

DEG = np.pi / 180


def Rx(a):
    return np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])


def Ry(a):
    return np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])


def Rz(a):
    return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])


def random_values(preset, count=200, seed=1):
    rng = np.random.default_rng(seed)
    R = Rotation.random(count, rng=rng)
    if preset.kind == "quaternion":
        return R.as_quat(scalar_first=preset.sequence == "wxyz") * rng.choice([-1, 1], (count, 1))
    if preset.kind == "rotation vector":
        return R.as_rotvec()
    if preset.kind == "matrix":
        return R.as_matrix().reshape(count, 9)
    return rng.uniform(-np.pi, np.pi, (count, 3))


@pytest.mark.parametrize("name", ORIENTATIONS)
def test_values_to_rotation_to_values_to_rotation(name):
    preset = ORIENTATIONS[name]
    R = rotations_from_values(preset, random_values(preset))
    np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.eye(3)[None].repeat(200, 0), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-14)
    values = values_from_rotations(preset, R)
    assert values.shape == (200, len(preset.fields))
    np.testing.assert_allclose(rotations_from_values(preset, values), R, atol=1e-8)
    # What the package writes it also reads as written: one value per rotation.
    again = values_from_rotations(preset, rotations_from_values(preset, values))
    np.testing.assert_allclose(rotations_from_values(preset, again), R, atol=1e-8)
    tame = np.abs(values).max(axis=1) < 3.1
    np.testing.assert_allclose(again[tame], values[tame], atol=1e-6)


EXPLICIT = {
    "kuka": lambda a, b, c: Rz(a) @ Ry(b) @ Rx(c),
    "fanuc": lambda w, p, r: Rz(r) @ Ry(p) @ Rx(w),
    "yaskawa": lambda x, y, z: Rz(z) @ Ry(y) @ Rx(x),
    "abb-angles": lambda z, y, x: Rz(z) @ Ry(y) @ Rx(x),
    "kawasaki": lambda o, a, t: Rz(o) @ Ry(a) @ Rz(t),
    "staubli": lambda x, y, z: Rx(x) @ Ry(y) @ Rz(z),
    "euler-ZXZ": lambda a, b, c: Rz(a) @ Rx(b) @ Rz(c),
    "euler-zxy": lambda a, b, c: Ry(c) @ Rx(b) @ Rz(a),
}


@pytest.mark.parametrize("name", EXPLICIT)
def test_angles_are_the_product_written_out(name):
    preset = ORIENTATIONS[name]
    values = random_values(preset)
    expected = np.array([EXPLICIT[name](*row) for row in values])
    np.testing.assert_allclose(rotations_from_values(preset, values), expected, atol=1e-14)


def test_kuka_is_fanuc_read_backwards():
    R = Rotation.random(200, rng=np.random.default_rng(2)).as_matrix()
    kuka = values_from_rotations(ORIENTATIONS["kuka"], R)
    fanuc = values_from_rotations(ORIENTATIONS["fanuc"], R)
    np.testing.assert_allclose(kuka, fanuc[:, ::-1], atol=1e-12)


def test_universal_robots_write_axis_times_angle():
    values = random_values(ORIENTATIONS["ur"])
    np.testing.assert_allclose(rotations_from_values(ORIENTATIONS["ur"], values), exp_rotation(values), atol=1e-14)
    quarter = rotations_from_values(ORIENTATIONS["ur"], np.array([[0, 0, np.pi / 2]]))[0]
    np.testing.assert_allclose(quarter, Rz(np.pi / 2), atol=1e-15)


def test_abb_writes_the_scalar_first():
    """A quarter turn about x: q1 is the cosine of half the angle."""
    half = 45 * DEG
    values = np.array([[np.cos(half), np.sin(half), 0, 0]])
    np.testing.assert_allclose(rotations_from_values(ORIENTATIONS["abb"], values)[0], Rx(2 * half), atol=1e-15)
    last = ORIENTATIONS["quaternion-xyzw"]
    np.testing.assert_allclose(rotations_from_values(last, values[:, [1, 2, 3, 0]])[0], Rx(2 * half), atol=1e-15)


def test_wrong_order_is_a_different_rotation():
    """The same three numbers in another maker's order miss by tens of degrees: none stands for another."""
    values = np.array([[30.0, -40.0, 50.0]]) * DEG
    R = {name: rotations_from_values(ORIENTATIONS[name], values)[0] for name in ("kuka", "fanuc", "kawasaki")}
    for one, other in (("kuka", "fanuc"), ("fanuc", "kawasaki"), ("kuka", "kawasaki")):
        assert Rotation.from_matrix(R[one].T @ R[other]).magnitude() > 10 * DEG


@pytest.mark.parametrize("name", [n for n, p in ORIENTATIONS.items() if p.kind == "angles"])
def test_gimbal_lock_keeps_the_rotation_and_stays_silent(name):
    preset = ORIENTATIONS[name]
    proper = preset.sequence[0].lower() == preset.sequence[2].lower()
    for middle in (0.0, 180.0) if proper else (90.0, -90.0):
        values = np.array([[20.0, middle, 35.0]]) * DEG
        R = rotations_from_values(preset, values)
        written = values_from_rotations(preset, R)
        assert written[0, 2] == 0.0
        np.testing.assert_allclose(rotations_from_values(preset, written), R, atol=1e-7)


def test_rounded_quaternions_and_matrices_are_put_right():
    R = Rotation.random(50, rng=np.random.default_rng(3))
    for name, values in (
        ("quaternion-wxyz", R.as_quat(scalar_first=True)),
        ("matrix", R.as_matrix().reshape(-1, 9)),
    ):
        got = rotations_from_values(ORIENTATIONS[name], values.round(5))
        np.testing.assert_allclose(got @ got.swapaxes(1, 2), np.eye(3)[None].repeat(50, 0), atol=1e-14)
        np.testing.assert_allclose(got, R.as_matrix(), atol=3e-5)


def test_a_quaternion_that_is_none_is_refused():
    values = np.array([[1.0, 0, 0, 0], [0.9, 0.1, 0.5, 0.0]])
    with pytest.raises(ValueError, match=r"row 2 has length 1\.0344"):
        rotations_from_values(ORIENTATIONS["quaternion-wxyz"], values)


@pytest.mark.parametrize(
    ("matrix", "word"),
    [
        (np.diag([1.0, 1, -1]), "mirrored"),
        (np.diag([1.0, 1, 1.01]), "orthonormality"),
        (np.ones((3, 3)), "not a rotation"),
    ],
)
def test_a_matrix_that_is_no_rotation_is_refused(matrix, word):
    with pytest.raises(ValueError, match=word):
        rotations_from_values(ORIENTATIONS["matrix"], matrix.reshape(1, 9))


def test_every_angle_order_is_there():
    """Twelve orders, about moving and about fixed axes."""
    assert sum(name.startswith("euler-") for name in ORIENTATIONS) == 24
    for name, preset in ORIENTATIONS.items():
        assert len(set(preset.fields)) == len(preset.fields), name
        assert preset.is_angle == (preset.kind in {"angles", "rotation vector"})
