"""How often is a motion that cannot show the head named rightly, and how often is a good one refused?

    python benchmarks/degenerate_motion.py [SETS]

SETS (1,000) recordings of every degenerate kind and as many good ones, half with the head in the hand, half with a
fixed one: 5-60 shots, 1-6 placements, lengths of 0.2 to 3 m, angular noise of robot and camera together of 0.001° to
1° and noise of positions of 1 µm to 2 mm, both log-uniform, the robot's share of it anything; "heavy noise" is 1° and
2 mm always. The words are right when they name what the geometry of that kind hides, no more and no less: noise may
hide more.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sixthlink.calibrate.head import HeadProblem, head_problem, observability
from sixthlink.errors import TooFewShotsError
from sixthlink.recording import EYE_IN_HAND, EYE_TO_HAND

POSITIONS, ALONG = "frame, all three directions", "position along the common axis"
ANGLES, ABOUT = "frame, all three angles", "orientation about"
HEAVY = ", heavy noise"


@dataclass(frozen=True)
class Scene:
    """Rotations and positions of the outer frame, placements, and what must be named, with its axis."""

    rotations: np.ndarray
    positions_m: np.ndarray
    placements: np.ndarray
    words: tuple[str, ...]
    axis: np.ndarray | None = None


def unit(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def dealt(rng: np.random.Generator, shots: int, placements: int) -> np.ndarray:
    """At least three shots each; the rest anywhere."""
    return np.sort(np.r_[np.repeat(np.arange(placements), 3), rng.integers(0, placements, shots - 3 * placements)])


def shape(rng: np.random.Generator) -> tuple[int, np.ndarray, float]:
    shots = int(rng.integers(5, 61))
    placements = dealt(rng, shots, int(rng.integers(1, min(6, shots // 3) + 1)))
    return shots, placements, float(np.exp(rng.uniform(np.log(0.2), np.log(3.0))))


def about(axis: np.ndarray, angles: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(angles[:, None] * axis).as_matrix()


def spread(rng: np.random.Generator, shots: int, size_m: float) -> np.ndarray:
    return rng.uniform(-0.4, 0.4, (shots, 3)) * size_m


def starts(rng: np.random.Generator, axis: np.ndarray, placements: np.ndarray) -> np.ndarray:
    """Outer rotation of each placement: another base direction, the same axis in the outer frame."""
    return Rotation.random(int(placements.max()) + 1, random_state=rng).as_matrix()[placements]


def parallel(rng: np.random.Generator) -> Scene:
    """Turns of 20° to a full turn about one axis of the flange, the robot moving freely between."""
    shots, placements, size_m = shape(rng)
    axis = unit(rng)
    angles = np.linspace(-1.0, 1.0, shots) * rng.uniform(0.35, np.pi)
    R = starts(rng, axis, placements) @ about(axis, rng.permutation(angles))
    return Scene(R, spread(rng, shots, size_m), placements, (ALONG,), axis)


def parallel_few(rng: np.random.Generator) -> Scene:
    """The same with three or four shots, or two of two or three placements each."""
    placements = np.array([[0, 0, 0], [0, 0, 0, 0], [0, 0, 1, 1], [0, 0, 1, 1, 2, 2]][rng.integers(4)], dtype=int)
    axis = unit(rng)
    angles = np.concatenate([[0.0, 1.0]] * 3)[: len(placements)] * rng.uniform(0.6, 1.5)
    angles = angles + rng.uniform(-0.2, 0.2, len(placements))
    R = starts(rng, axis, placements) @ about(axis, angles)
    return Scene(R, spread(rng, len(placements), 0.8), placements, (ALONG,), axis)


def translation(rng: np.random.Generator) -> Scene:
    shots, placements, size_m = shape(rng)
    R = Rotation.random(int(placements.max()) + 1, random_state=rng).as_matrix()[placements]
    return Scene(R, spread(rng, shots, size_m), placements, (POSITIONS,))


def line(rng: np.random.Generator) -> Scene:
    """Pure translation along one line of the flange."""
    scene = translation(rng)
    along = unit(rng)
    steps = rng.permutation(np.linspace(-0.4, 0.4, len(scene.placements)))[:, None] * np.linalg.norm(
        np.ptp(scene.positions_m, axis=0)
    )
    moved = (scene.rotations @ (steps * along)[..., None])[..., 0]
    return Scene(scene.rotations, moved, scene.placements, (POSITIONS, ABOUT), along)


def little(rng: np.random.Generator) -> Scene:
    """Turns about any axes, up to 1.5°."""
    scene = translation(rng)
    turns = rng.normal(size=(len(scene.placements), 3))
    turns *= np.deg2rad(rng.uniform(0.0, 1.5)) / np.linalg.norm(turns, axis=1, keepdims=True)
    R = scene.rotations @ Rotation.from_rotvec(turns).as_matrix()
    return Scene(R, scene.positions_m, scene.placements, scene.words)


def identical(rng: np.random.Generator) -> Scene:
    scene = translation(rng)
    places = spread(rng, int(scene.placements.max()) + 1, 1.0)
    return Scene(scene.rotations, places[scene.placements], scene.placements, (POSITIONS, ANGLES))


def one_joint(rng: np.random.Generator) -> Scene:
    """One turning joint moves, everything else stands: a turn about one line in space."""
    shots, _, size_m = shape(rng)
    placements = np.zeros(shots, dtype=int)
    axis, angles = unit(rng), rng.uniform(0.35, 2.0) * np.linspace(-1.0, 1.0, shots)
    outer = about(axis, angles)
    return Scene(outer, (outer @ (unit(rng) * size_m)), placements, (ALONG, ABOUT), axis)


def good(rng: np.random.Generator) -> Scene:
    """Turns about any axes, 20° and more; half the sets turn much about one axis and tilt by only 20° beside."""
    shots, placements, size_m = shape(rng)
    tilt = np.deg2rad(np.exp(rng.uniform(np.log(20.0), np.log(90.0))))
    turns = rng.normal(size=(shots, 3))
    if rng.random() < 0.5:
        axis, tilt = unit(rng), np.deg2rad(20.0)
        turns -= (turns @ axis)[:, None] * axis
        spin = about(axis, rng.uniform(-np.pi, np.pi, shots) * rng.uniform(0.0, 1.0))
    else:
        spin = np.tile(np.eye(3), (shots, 1, 1))
    turns *= tilt / np.linalg.norm(turns, axis=1, keepdims=True)
    R = starts(rng, np.zeros(3), placements) @ spin @ Rotation.from_rotvec(turns).as_matrix()
    return Scene(R, spread(rng, shots, size_m), placements, ())


def good_few(rng: np.random.Generator) -> Scene:
    """Two shots at each of three to six placements, every motion 20° or more about an axis of its own."""
    placements = np.repeat(np.arange(rng.integers(3, 7)), 2)
    R = starts(rng, np.zeros(3), placements)
    axes = Rotation.random(random_state=rng).as_matrix()[np.arange(placements.max() + 1) % 3]
    angles = rng.uniform(np.deg2rad(20.0), 1.5, len(axes))
    R[1::2] = R[::2] @ Rotation.from_rotvec(angles[:, None] * axes).as_matrix()
    return Scene(R, spread(rng, len(placements), 0.8), placements, ())


def recorded(rng: np.random.Generator, scene: Scene, *, heavy: bool = False) -> HeadProblem:
    """Noisy shots of a scene: the target 0.2 to 3 m before the head, noise shared between robot and camera."""
    N, P = len(scene.placements), int(scene.placements.max()) + 1
    size_m = float(np.exp(rng.uniform(np.log(0.2), np.log(3.0))))
    sigma_rad, sigma_m = np.deg2rad(10 ** rng.uniform(-3, 0)), 10 ** rng.uniform(-6, np.log10(2e-3))
    if heavy:
        sigma_rad, sigma_m = np.deg2rad(1.0), 2e-3
    outer = np.tile(np.eye(4), (N, 1, 1))
    outer[:, :3, :3], outer[:, :3, 3] = scene.rotations, scene.positions_m
    X, targets = np.eye(4), np.tile(np.eye(4), (P, 1, 1))
    X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-0.3, 0.3, 3) * min(size_m, 1.0)
    for p in range(P):
        mean = outer[scene.placements == p][0] @ X
        targets[p, :3, 3] = mean[:3, :3] @ (size_m * unit(rng)) + mean[:3, 3]
        targets[p, :3, :3] = Rotation.random(random_state=rng).as_matrix()
    inner = np.linalg.inv(outer @ X) @ targets[scene.placements]
    share = rng.uniform()
    seen = shaken(rng, inner, (1 - share) * sigma_rad, (1 - share) * sigma_m)
    if rng.random() < 0.5:
        return head_problem(EYE_IN_HAND, shaken(rng, outer, share * sigma_rad, share * sigma_m), seen, scene.placements)
    flange = shaken(rng, np.linalg.inv(outer), share * sigma_rad, share * sigma_m)
    return head_problem(EYE_TO_HAND, flange, seen, scene.placements)


def shaken(rng: np.random.Generator, Ts: np.ndarray, sigma_rad: float, sigma_m: float) -> np.ndarray:
    moved = Ts.copy()
    moved[:, :3, :3] = Ts[:, :3, :3] @ Rotation.from_rotvec(rng.normal(0, 1, (len(Ts), 3)) * sigma_rad).as_matrix()
    moved[:, :3, 3] += rng.normal(0, 1, (len(Ts), 3)) * sigma_m
    return moved


def named(words: tuple[str, ...], expected: tuple[str, ...]) -> bool:
    return len(words) == len(expected) and all(e in w for e, w in zip(expected, words, strict=True))


def axis_error(words: tuple[str, ...], axis: np.ndarray) -> float:
    """Largest angle [degree] between the true axis and those named in the words."""
    axes = [
        np.array([float(v) for v in found.split(",")]) for w in words for found in re.findall(r"\(([-\d., ]+)\)", w)
    ]
    angles = [np.arctan2(np.linalg.norm(np.cross(a, axis)), abs(a @ axis)) for a in axes]
    return float(np.rad2deg(max(angles, default=0.0)))


def report(name: str, build: Callable[[np.random.Generator], Scene], sets: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    flagged, right, errors, other = 0, 0, [], []
    for _ in range(sets):
        scene = build(rng)
        seen = observability(recorded(rng, scene, heavy=name.endswith(HEAVY)), carrier="flange")
        flagged += not seen.complete
        good_words = named(seen.words, scene.words)
        right += good_words
        if scene.axis is not None and good_words:
            errors.append(axis_error(seen.words, scene.axis))
        if not good_words:
            other.append((seen.words, seen.excitations.round(4), round(seen.limit, 4), len(scene.placements)))
    line = f"{name:<34} flagged {flagged:>5} of {sets}, in the right words {right:>5}"
    if errors:
        line += f", axis off by {np.median(errors):.2f}° (median), {np.percentile(errors, 99):.1f}° (99 %)"
    print(line, flush=True)
    if "-v" in sys.argv:
        for entry in other[:6]:
            print("      ", *entry)


def two_shots(sets: int) -> None:
    rng, named_axes = np.random.default_rng(99), 0
    for _ in range(sets):
        scene = parallel(rng)
        first = np.flatnonzero(scene.placements == 0)[[0, -1]]
        scene = Scene(scene.rotations[first], scene.positions_m[first], np.zeros(2, dtype=int), ())
        try:
            recorded(rng, scene)
        except TooFewShotsError as refusal:
            named_axes += "one motion" in str(refusal)
    print(f"{'one placement with two shots':<34} refused and named {named_axes} of {sets}")


KINDS = {
    "pure translation": translation,
    "translation along one line": line,
    "parallel axes": parallel,
    "parallel axes, 3 to 6 shots": parallel_few,
    "one joint only": one_joint,
    "too little rotation": little,
    "identical poses": identical,
    "pure translation" + HEAVY: translation,
    "parallel axes" + HEAVY: parallel,
    "identical poses" + HEAVY: identical,
    "good": good,
    "good" + HEAVY: good,
    "good, two shots per placement": good_few,
}

if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1].isdigit() else 1000
    for number, (kind, builder) in enumerate(KINDS.items()):
        report(kind, builder, count, number)
    two_shots(count)
