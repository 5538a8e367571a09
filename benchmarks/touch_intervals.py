"""Which model of a real arm's errors gives honest intervals, and is it honest where the noise is independent?

    python benchmarks/touch_intervals.py            # on real robots: each part of the model left out in turn
    python benchmarks/touch_intervals.py 200        # simulated: coverage of 200 readings under four kinds of errors

Simulated readings stand where panda_1 touched: links off by the maker's tolerances, sockets 50 mm apart with a standard
deviation of 1 mm where they are read and of 0.1 mm (as certified) where they calibrate, contact 0.1 mm.
The last kind has errors of another make than the model: joints that err once and twice per turn and yield to the load,
0.5 mrad each and 1 mrad per metre of lever.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.calibrate.arm import arm_motions, arm_with_steps, link_parameters, optional_parameters
from sixthlink.calibrate.joint import JointData, estimate, estimate_with_blocks, start_of
from sixthlink.calibrate.observations import carried
from sixthlink.calibrate.touches.settle import SettledTouches, settled_touches
from sixthlink.calibrate.touches.sockets import Touches, touch_data
from sixthlink.files import load_arm
from sixthlink.geometry import Floats
from sixthlink.target import SOCKET, LengthStandard

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from recordings import MUKCA

DATA = Path(__file__).parents[2] / "shared" / "data" / "mukca_two_socket_50mm"
MARKS = ("socket_0", "socket_1")
GAUGE = LengthStandard(0.05, 1e-4, SOCKET, marks=MARKS)
COVERAGE = 1.959963984540054
TOOL_M = np.array([0.0, 0.0, 0.139])

KINDS = ("new with every touch", "by pose", "by pose and socket", "periodic and yielding")
MODELS = {
    "new with every touch": ("joints", "contact"),
    "and by socket": ("joints", "contact", "socket"),
    "and by pose": ("joints", "contact", "pose"),
    "all": ("joints", "contact", "socket", "pose"),
}


def touches_at(robot: str, places: tuple[str, ...]) -> Touches:
    shots: list[tuple[str, str, list[float]]] = []
    for place in places:
        for mark in MARKS:
            with (DATA / robot / place / f"{mark}.csv").open(newline="") as file:
                table = list(csv.reader(line for line in file if not line.startswith("#")))[1:]
            shots += [(place, mark, [float(v) for v in row]) for row in table]
    names = tuple(str(k) for k in range(len(shots)))
    return Touches(
        names, tuple(s[0] for s in shots), tuple(s[1] for s in shots), np.array([s[2] for s in shots]), GAUGE
    )


def length_and_std(settled: SettledTouches, place: int = 1) -> tuple[float, float]:
    return settled.distance(place, (0, 1), coverage=COVERAGE)


def pairs() -> list[tuple[str, str, str]]:
    named = {robot: sorted(p.name for p in (DATA / robot).iterdir()) for robot in MUKCA}
    return [(r, a, b) for r, places in named.items() for a in places for b in places if a != b]


def row(name: str, errors: list[float], stds: list[float]) -> str:
    e, s = np.array(errors), np.hypot(stds, GAUGE.uncertainty_m)
    outside = int(np.count_nonzero(np.abs(e) > COVERAGE * s))
    worst = [max(abs(x) for x, (r, _, _) in zip(errors, pairs(), strict=True) if r == robot) for robot in MUKCA]
    cells = [f"{w * 1e3:.3f}" for w in worst] + [f"{np.sqrt(np.mean(e**2)) * 1e3:.3f}", f"{np.median(s) * 1e3:.3f}"]
    return f"| {name} | " + " | ".join(cells) + f" | {np.sqrt(np.mean((e / s) ** 2)):.2f} | {outside} of {len(e)} |"


def real() -> None:
    print(
        "| errors of joints that are | " + " | ".join(MUKCA) + " | RMS | median std | RMS error / std | 50.0 outside |"
    )
    print("|---|---|---|---|---|---|---|---|")
    known = {}
    for robot, at, read in pairs():
        arm = load_arm(MUKCA[robot], folder=Path())
        data = touch_data(arm, touches_at(robot, (at, read)), unknown=(read,))
        known[robot, at, read] = data, estimate(data)
    for name, parts in MODELS.items():
        found = [length_and_std(settled_touches(*known[p], parts=parts)) for p in pairs()]
        print(row(name, [f[0] - 0.05 for f in found], [f[1] for f in found]), flush=True)
    found = [length_and_std(settled_touches(d, estimate_with_blocks(d)[0])) for d, _ in known.values()]
    print(row("all, and blocks by held-out touches", [f[0] - 0.05 for f in found], [f[1] for f in found]), flush=True)
    lengths = {}
    for robot, at, _ in pairs():
        others = tuple(sorted(p.name for p in (DATA / robot).iterdir() if p.name != at))
        if (robot, at, others[0]) not in lengths:
            arm = load_arm(MUKCA[robot], folder=Path())
            data = touch_data(arm, touches_at(robot, (at, *others)), unknown=others)
            settled = settled_touches(data, estimate(data))
            lengths |= {(robot, at, o): length_and_std(settled, 1 + k) for k, o in enumerate(others)}
    found = [lengths[p] for p in pairs()]
    print(row("all, every place in one estimate", [f[0] - 0.05 for f in found], [f[1] for f in found]), flush=True)


def drawn(rng: np.random.Generator, kind: str) -> tuple[JointData, float]:
    """Touches at two places of panda_1 as a fresh arm would make them, and the true length at the second."""
    names = sorted(p.name for p in (DATA / "panda_1").iterdir())
    places = tuple(names[k] for k in rng.permutation(3)[:2])
    nominal = load_arm("franka_panda", folder=Path())
    touches = touches_at("panda_1", places)
    data = touch_data(nominal, touches, unknown=places[1:])
    links = link_parameters(nominal)
    true = arm_with_steps(nominal, links, np.array([p.sigma for p in links]) * rng.standard_normal(len(links)))
    if kind == "periodic and yielding":
        more = optional_parameters(nominal, "harmonics") + optional_parameters(nominal, "compliance")
        true = arm_with_steps(true, more, np.array([p.sigma for p in more]) * rng.standard_normal(len(more)))
    lengths = 0.05 + np.array([1e-4, 1e-3]) * rng.standard_normal(2)
    points = np.array(start_of(data)[0].points_m)
    middle, way = points.mean(axis=1), points[:, 1] - points[:, 0]
    way *= (0.5 * lengths / np.linalg.norm(way, axis=1))[:, None]
    points = np.stack([middle - way, middle + way], axis=1)
    place, point = touches.numbers()
    goal = points[place, point] + 1e-4 * rng.standard_normal((len(place), 3))
    joints = _reached(true, touches.joints, goal, _errors(rng, kind, touches.joints, 2 * place + point))
    assert data.touches is not None
    return replace(data, touches=replace(data.touches, joints=joints)), float(lengths[1])


def _errors(rng: np.random.Generator, kind: str, q: Floats, sockets: Floats) -> Floats:
    stated = 1.2e-4
    errors = stated * rng.standard_normal(q.shape)
    if kind in {"by pose", "by pose and socket"}:
        alike = np.exp(-0.5 * np.sum((q[:, None] - q[None]) ** 2, axis=2) / 2.0**2) + 1e-9 * np.eye(len(q))
        errors += 4.0 * stated * np.linalg.cholesky(alike) @ rng.standard_normal(q.shape)
    if kind == "by pose and socket":
        errors += 2.0 * stated * rng.standard_normal((4, q.shape[1]))[sockets]
    return errors


def _reached(arm, q: Floats, goal: Floats, errors: Floats) -> Floats:
    """Joint values that the controller reports when the ball is where it should be."""
    for _ in range(6):
        Ts, _, by_joint = arm_motions(arm, q + errors, ())
        levers = Ts[:, :3, :3] @ TOOL_M
        J = carried(levers)[:, :3] @ by_joint
        q = q - (np.linalg.pinv(J) @ (levers + Ts[:, :3, 3] - goal)[:, :, None])[:, :, 0]
    return q


def simulated(trials: int, kinds: tuple[str, ...] = KINDS) -> None:
    print("| joint errors | model | coverage | RMS error, mm | median std, mm | 90 % of them below |")
    print("|---|---|---|---|---|---|")
    for kind in kinds:
        found: dict[str, list[tuple[float, float]]] = {"new with every touch": [], "all": []}
        for seed in range(trials):
            data, true = drawn(np.random.default_rng(seed), kind)
            start = estimate(data)
            for model, values in found.items():
                length, std = length_and_std(settled_touches(data, start, parts=MODELS[model]))
                values.append((length - true, std))
        for model, values in found.items():
            errors, stds = np.array(values).T
            inside = float(np.mean(np.abs(errors) < COVERAGE * stds))
            rms = float(np.sqrt(np.mean(errors**2)))
            print(
                f"| {kind} | {model} | {inside:.3f} | {rms * 1e3:.3f} | {np.median(stds) * 1e3:.3f} "
                f"| {np.quantile(stds, 0.9) * 1e3:.3f} |",
                flush=True,
            )


if __name__ == "__main__":
    simulated(int(sys.argv[1])) if len(sys.argv) > 1 else real()
