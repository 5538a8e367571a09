"""Do the closed forms find the head, whatever the frames, units and order, and say so when they cannot?"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from sixthlink.calibrate.head.closed_form import CLOSED_FORMS
from sixthlink.errors import DegenerateMotionError, TooFewShotsError
from sixthlink.geometry import (
    Floats,
    apply_motion,
    exp_rotation,
    inverse,
    motion_between,
    rotation_angle,
    transform,
)

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"

METHODS = list(CLOSED_FORMS)

NOISE = np.array([1e-4] * 3 + [np.deg2rad(0.05)] * 3)
"""Standard deviation of each coordinate of a pose in the noisy laws [m, rad]."""


def _turned(axis: str, angle: float) -> Floats:
    return exp_rotation(angle * np.eye(3)["xyz".index(axis)])


def _scene(seed: int, X: Floats, shots: int = 12, placements: int = 1) -> tuple[Floats, Floats, np.ndarray]:
    """Exact shots of a head that looks at a target from all sides within 35°, rolled by up to 80°."""
    rng = np.random.default_rng(seed)
    tilt, azimuth, roll = (
        rng.uniform(0.0, 0.6, shots),
        rng.uniform(0, 2 * np.pi, shots),
        rng.uniform(-1.4, 1.4, shots),
    )
    zero = np.zeros(shots)
    R_tilt = exp_rotation(np.stack([tilt * np.cos(azimuth), tilt * np.sin(azimuth), zero], axis=1))
    R = exp_rotation(np.stack([zero, zero, roll], axis=1)) @ _turned("x", np.pi) @ R_tilt
    t = np.column_stack([rng.uniform(-0.1, 0.1, (shots, 2)), rng.uniform(0.4, 0.8, shots)])
    Ts_head_target = transform(R, t)
    where = np.arange(shots) % placements
    Ts_base_target = transform(exp_rotation(rng.normal(size=(placements, 3))), rng.uniform(-1, 1, (placements, 3)))
    return Ts_base_target[where] @ inverse(Ts_head_target) @ inverse(X), Ts_head_target, where


def _head(seed: int = 5) -> Floats:
    rng = np.random.default_rng(seed)
    return transform(exp_rotation(rng.normal(size=3)), rng.uniform(-0.2, 0.2, 3))


def _noisy(rng: np.random.Generator, Ts: Floats, sigmas: Floats = NOISE) -> Floats:
    return apply_motion(Ts, rng.normal(size=(len(Ts), 6)) * sigmas)


def _noisy_scene(seed: int, shots: int = 12, placements: int = 1) -> tuple[Floats, Floats, np.ndarray]:
    A, B, where = _scene(seed, _head(), shots, placements)
    rng = np.random.default_rng(seed + 1000)
    return _noisy(rng, A), _noisy(rng, B), where


def _assert_same_head(X: Floats, expected: Floats, tolerance: float = 1e-9) -> None:
    assert rotation_angle(X[:3, :3].T @ expected[:3, :3]) < tolerance
    assert np.linalg.norm(X[:3, 3] - expected[:3, 3]) < tolerance


HEADS = {
    "identity": np.eye(3),
    "random": exp_rotation(np.array([0.4, -1.1, 0.7])),
    "beta +90°": _turned("x", 0.3) @ _turned("y", np.pi / 2) @ _turned("z", 1.1),
    "beta -90°": _turned("x", 0.3) @ _turned("y", -np.pi / 2) @ _turned("z", 1.1),
    "half turn x": _turned("x", np.pi),
    "half turn y": _turned("y", np.pi),
    "half turn z": _turned("z", np.pi),
    "half turn oblique": exp_rotation(np.pi * np.array([2.0, -1.0, 2.0]) / 3.0),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("head", HEADS)
def test_exact_shots_give_the_exact_head(method: str, head: str) -> None:
    X = transform(HEADS[head], [0.06, -0.04, 0.12])
    _assert_same_head(CLOSED_FORMS[method](*_scene(1, X)), X)


@pytest.mark.parametrize("method", METHODS)
def test_three_shots_are_enough(method: str) -> None:
    _assert_same_head(CLOSED_FORMS[method](*_scene(3, _head(), shots=3)), _head())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("offset", [0.0, 1e-9, -1e-6])
def test_motions_of_half_a_turn_do_no_harm(method: str, offset: float) -> None:
    """The first shot is half a turn from all others, where rounding decides between q and -q."""
    rng = np.random.default_rng(8)
    axes = rng.normal(size=(7, 3))
    turns = (np.pi + offset) * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    A = transform(np.concatenate([np.eye(3)[None], exp_rotation(turns)]), rng.uniform(-0.5, 0.5, (8, 3)))
    X, T_base_target = _head(), transform(exp_rotation(rng.normal(size=3)), [1.0, 0.2, 0.1])
    B = inverse(A @ X) @ T_base_target
    found = CLOSED_FORMS[method](_noisy(rng, A, NOISE * 1e-3), _noisy(rng, B, NOISE * 1e-3), np.zeros(8, dtype=int))
    _assert_same_head(found, X, 1e-5)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [1000.0, 1.0 / 25.4e-3, 1e-3])
def test_unit_of_length_does_not_matter(method: str, scale: float) -> None:
    A, B, where = _noisy_scene(11)
    X = CLOSED_FORMS[method](A, B, where)
    A[:, :3, 3] *= scale
    B[:, :3, 3] *= scale
    scaled = CLOSED_FORMS[method](A, B, where)
    scaled[:3, 3] /= scale
    _assert_same_head(scaled, X)


@pytest.mark.parametrize("method", METHODS)
def test_base_frame_does_not_matter(method: str) -> None:
    A, B, where = _noisy_scene(12, placements=2)
    T_other_base = transform(exp_rotation(np.array([2.0, -1.0, 0.5])), [3.0, -2.0, 5.0])
    _assert_same_head(CLOSED_FORMS[method](T_other_base @ A, B, where), CLOSED_FORMS[method](A, B, where))


@pytest.mark.parametrize("method", METHODS)
def test_axes_of_flange_and_head_do_not_matter(method: str) -> None:
    A, B, where = _noisy_scene(13)
    T_flange_other = transform(exp_rotation(np.array([0.3, 2.5, -0.4])), np.zeros(3))
    T_head_other = transform(_turned("y", np.pi), np.zeros(3))
    turned = CLOSED_FORMS[method](A @ T_flange_other, inverse(T_head_other) @ B, where)
    expected = inverse(T_flange_other) @ CLOSED_FORMS[method](A, B, where) @ T_head_other
    _assert_same_head(turned, expected)


@pytest.mark.parametrize("method", METHODS)
def test_order_and_numbering_of_shots_do_not_matter(method: str) -> None:
    A, B, where = _noisy_scene(14, shots=120, placements=2)
    order = np.random.default_rng(0).permutation(120)
    shuffled = CLOSED_FORMS[method](A[order], B[order], np.array([70, -3])[where[order]])
    _assert_same_head(shuffled, CLOSED_FORMS[method](A, B, where))


@pytest.mark.parametrize("method", METHODS)
def test_placements_share_one_head(method: str) -> None:
    X = _head()
    _assert_same_head(CLOSED_FORMS[method](*_scene(15, X, shots=15, placements=4)), X)


@pytest.mark.parametrize("method", METHODS)
def test_two_placements_complete_each_other(method: str) -> None:
    """Turns about one axis before the target moves, about another afterwards: neither alone is enough."""
    X, angles = _head(), np.linspace(-0.6, 0.6, 5)
    rng = np.random.default_rng(4)
    R = np.concatenate([exp_rotation(angles[:, None] * np.eye(3)[k]) for k in (2, 0)])
    A, where = transform(R, rng.uniform(-0.3, 0.3, (10, 3))), np.repeat([0, 1], 5)
    B = inverse(A @ X) @ transform(np.eye(3), np.array([[1.0, 0, 0], [0.8, 0.3, 0.1]]))[where]
    _assert_same_head(CLOSED_FORMS[method](A, B, where), X)
    with pytest.raises(DegenerateMotionError):
        CLOSED_FORMS[method](A[:5], B[:5], where[:5])


@pytest.mark.parametrize("method", METHODS)
def test_lone_shot_of_a_placement_changes_nothing(method: str) -> None:
    A, B, where = _noisy_scene(16)
    stray = transform(_turned("z", 1.0), [4.0, 4.0, 4.0])[None]
    more = CLOSED_FORMS[method](np.concatenate([A, stray]), np.concatenate([B, B[:1]]), np.append(where, 9))
    assert rotation_angle(more[:3, :3].T @ CLOSED_FORMS[method](A, B, where)[:3, :3]) < 1e-4


def _degenerate(kind: str, noise: float) -> tuple[Floats, Floats, np.ndarray]:
    rng = np.random.default_rng(21)
    X, angles = _head(), np.linspace(-1.0, 1.0, 15)[:, None]
    rotvecs = {
        "translations only": 0.0 * angles * np.eye(3)[2],
        "parallel axes": angles * np.array([0.6, 0.0, 0.8]),
        "turns of 0.1°": np.deg2rad(0.1) * rng.uniform(-1, 1, (15, 3)),
    }[kind]
    A = transform(exp_rotation(rotvecs), rng.uniform(-0.4, 0.4, (15, 3)))
    B = inverse(A @ X) @ transform(_turned("x", 0.4), [1.0, 0.0, 0.2])
    return _noisy(rng, A, NOISE * noise), _noisy(rng, B, NOISE * noise), np.zeros(15, dtype=int)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("noise", [0.0, 1.0, 10.0])
@pytest.mark.parametrize("kind", ["translations only", "parallel axes", "turns of 0.1°"])
def test_motion_that_hides_the_head_is_refused(method: str, kind: str, noise: float) -> None:
    with pytest.raises(DegenerateMotionError, match="tilt the flange by 20°") as caught:
        CLOSED_FORMS[method](*_degenerate(kind, noise))
    assert caught.value.directions


def test_refusal_names_the_common_axis() -> None:
    with pytest.raises(DegenerateMotionError) as caught:
        CLOSED_FORMS["park"](*_degenerate("parallel axes", 0.0))
    assert caught.value.directions == ("translation along the flange's (0.60, 0.00, 0.80)",)


def test_half_turns_alone_are_refused() -> None:
    A = transform(np.stack([np.eye(3), *(_turned(axis, np.pi) for axis in "xyz")]), np.eye(4)[:, :3] * 0.3)
    with pytest.raises(DegenerateMotionError, match="half turns"):
        CLOSED_FORMS["horaud"](A, inverse(A @ _head()), np.zeros(4, dtype=int))


def test_mispaired_shots_are_refused() -> None:
    A, B, where = _noisy_scene(17)
    with pytest.raises(DegenerateMotionError, match="paired with the wrong pose"):
        CLOSED_FORMS["park"](A, np.roll(B, 1, axis=0), where)


def test_too_few_motions_and_bad_numbers_are_refused() -> None:
    A, B, _ = _noisy_scene(18)
    with pytest.raises(TooFewShotsError) as caught:
        CLOSED_FORMS["li"](A[:4], B[:4], np.array([0, 0, 1, 2]))
    assert (caught.value.needed, caught.value.usable) == (5, 4)
    B[3, 0, 3] = np.nan
    with pytest.raises(ValueError, match="Ts_head_target has 1 entries that are not finite"):
        CLOSED_FORMS["li"](A, B, np.zeros(12, dtype=int))


def _bound(A: Floats, B: Floats, X: Floats) -> Floats:
    """Cramér-Rao covariance ``(6, 6)`` of X for noise on both sides, from differences of the loop itself."""
    Z = (A @ X @ B)[0]
    step = 1e-6

    def columns(moved: object) -> Floats:
        def loop(motion: Floats) -> Floats:
            return motion_between(np.broadcast_to(np.eye(4), A.shape), moved(motion))  # type: ignore[operator]

        return np.stack([(loop(step * e) - loop(-step * e)) / (2 * step) for e in np.eye(6)], axis=-1)

    noise = [
        columns(lambda m: inverse(Z) @ apply_motion(A, m) @ X @ B),
        columns(lambda m: inverse(Z) @ A @ X @ apply_motion(B, m)),
    ]
    J = np.concatenate(
        [
            columns(lambda m: inverse(Z) @ A @ apply_motion(X, m) @ B),
            columns(lambda m: inverse(apply_motion(Z, m)) @ A @ X @ B),
        ],
        axis=-1,
    )
    S = sum((N * NOISE**2) @ np.swapaxes(N, 1, 2) for N in noise)
    information = np.sum(np.swapaxes(J, 1, 2) @ np.linalg.solve(S, J), axis=0)
    return np.linalg.inv(information)[:6, :6]


@pytest.mark.parametrize("method", METHODS)
def test_noisy_heads_stand_near_the_theoretical_bound(method: str) -> None:
    """RMS errors over noise draws against the Cramér-Rao bound of the same shots."""
    X, rng = _head(), np.random.default_rng(6)
    A, B, where = _scene(19, X, shots=20)
    found = [CLOSED_FORMS[method](_noisy(rng, A), _noisy(rng, B), where) for _ in range(120)]
    errors = motion_between(np.broadcast_to(X, (120, 4, 4)), np.stack(found))
    rms = np.sqrt(np.mean(errors**2, axis=0))
    bound = np.sqrt(np.diag(_bound(A, B, X)))
    turn, shift = (np.linalg.norm(rms[k]) / np.linalg.norm(bound[k]) for k in (slice(3, 6), slice(0, 3)))
    joint = method in {"andreff", "daniilidis", "li"}
    assert 0.85 < turn < (1.4 if joint else 1.5)
    assert 0.85 < shift < 1.3


def test_choice_of_pairs_costs_no_accuracy() -> None:
    """With 300 shots Park and Tsai see one pair in seven; Horaud sums all of them."""
    X, rng = _head(), np.random.default_rng(7)
    A, B, where = _scene(20, X, shots=300)
    errors: dict[str, list[float]] = {"tsai": [], "park": [], "horaud": []}
    for _ in range(25):
        shots = _noisy(rng, A), _noisy(rng, B), where
        for method, found in errors.items():
            found.append(float(rotation_angle(CLOSED_FORMS[method](*shots)[:3, :3].T @ X[:3, :3])))
    rms = {method: np.sqrt(np.mean(np.square(found))) for method, found in errors.items()}
    assert rms["tsai"] < 1.1 * rms["horaud"]
    assert rms["park"] < 1.1 * rms["horaud"]


def test_inputs_are_left_alone() -> None:
    A, B, where = _noisy_scene(22)
    kept = A.copy(), B.copy(), where.copy()
    for method in CLOSED_FORMS.values():
        method(A, B, where)
    assert all(np.array_equal(a, b) for a, b in zip((A, B, where), kept, strict=True))


def test_public_eye_to_hand_recording() -> None:
    """50 real pose pairs of a fixed camera; the published answer is good to 1 %."""
    folder = DATA / "moveit_eye_to_hand_poses"
    if not folder.is_dir():
        message = f"public recording not found at {folder}"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    A, B = (_poses(folder / name) for name in ("poses.csv", "cam_T_target.csv"))
    for method in CLOSED_FORMS.values():
        X = method(inverse(A), B, np.zeros(len(A), dtype=int))
        assert np.abs(X[:3, 3] - [0.659, -0.249, 0.830]).max() < 0.003


def _poses(path: Path) -> Floats:
    rows = [line.split(",")[1:] for line in path.read_text().splitlines()[2:]]
    T = np.array(rows, dtype=np.float64).reshape(-1, 4, 4)
    T[:, :3, 3] /= 1000.0
    return T


def test_agrees_with_opencv_on_exact_shots() -> None:
    import cv2

    if not hasattr(cv2, "calibrateHandEye"):
        pytest.skip("this OpenCV lost its hand-eye functions; the comparison with 4.14 lives in benchmarks/")
    A, B, where = _scene(23, _head(), shots=10)
    for k, method in enumerate(("tsai", "park", "horaud", "andreff", "daniilidis")):
        R, t = cv2.calibrateHandEye(
            list(A[:, :3, :3]), list(A[:, :3, 3]), list(B[:, :3, :3]), list(B[:, :3, 3]), method=k
        )
        _assert_same_head(transform(R, t.ravel()), CLOSED_FORMS[method](A, B, where), 1e-6)
