"""How does a named scene become a recording folder with its truth beside it?"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from sixthlink.errors import Finding, InputError
from sixthlink.files import atomic_write_bytes, load_arm, write_arm, write_recording, write_tracker_record, write_truth
from sixthlink.progress import Progress
from sixthlink.simulate import SCENARIOS, SimulatedCell, TrackerSession, render_image, simulate_cell, simulate_tracking
from sixthlink.target import Chessboard
from sixthlink.workflow.outcome import Outcome

__all__ = ["simulate_folder"]


def simulate_folder(
    out: Path,
    *,
    scenario: str,
    seed: int,
    images: bool,
    scale_placements: int,
    progress: Progress,
    tracker: bool = False,
) -> Outcome:
    """Write a simulated recording to ``out`` and the truth to ``out/truth``.

    With ``tracker`` also what a laser tracker saw of the same arm, to ``out/tracker``.

    Raises:
        InputError: The scenario is unknown, or the folder holds a recording already.
    """
    if scenario not in SCENARIOS:
        finding = Finding(
            "--scenario",
            "scenario",
            f"{scenario!r} is unknown",
            f"one of {sorted(SCENARIOS)}",
            "choose one of them",
        )
        raise InputError([finding])
    plan = SCENARIOS[scenario]
    arm = load_arm("abb_irb1400", folder=out)
    board = Chessboard(columns=plan.columns, rows=plan.rows, square_m=plan.square_m)
    cell = simulate_cell(plan, arm, board, seed=seed, scale_placements=scale_placements, images=images)
    write_recording(out, cell.recording, robot={"name": "abb_irb1400"})
    truth = out / "truth"
    truth.mkdir(exist_ok=True)
    files = {"recording": out / "recording.yaml", "shots": out / "shots.csv", "arm": truth / "arm.yaml"}
    write_arm(files["arm"], cell.truth.arm)
    files["truth"] = truth / "truth.json"
    write_truth(files["truth"], cell)
    if tracker:
        session = simulate_tracking(plan, TrackerSession(), arm, seed=seed)
        write_tracker_record(out / "tracker", session.record, robot={"name": "abb_irb1400"})
        files["tracker"] = out / "tracker" / "tracker.yaml"
    if images:
        _render_all(out, cell, progress)
    return Outcome(files)


def _render_all(out: Path, cell: SimulatedCell, progress: Progress) -> None:
    jobs = [
        (i, c, out / cell.recording.images[camera.name][i])
        for i in range(len(cell.recording.ids))
        for c, camera in enumerate(cell.recording.head.cameras)
        if cell.recording.images[camera.name][i]
    ]
    for parent in {path.parent for _, _, path in jobs}:
        parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(mp_context=get_context("spawn"), initializer=_adopt, initargs=(cell,)) as pool:
        for done, _ in enumerate(pool.map(_render_one, jobs, chunksize=4), start=1):
            progress.step("render images", done, len(jobs))


_adopted: list[SimulatedCell] = []


def _adopt(cell: SimulatedCell) -> None:
    """Hand the scene to a worker once instead of with every image."""
    _adopted.append(cell)


def _render_one(job: tuple[int, int, Path]) -> None:
    import cv2

    shot, camera, path = job
    encoded = cv2.imencode(".png", render_image(_adopted[0], shot, camera), [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    atomic_write_bytes(path, encoded.tobytes())
