"""How long does a table of a million tracker points take to read?

    PYTHONPATH=src .venv/bin/python benchmarks/tracker_tables.py        (make bench)

Each dialect holds the same points: a name, x, y, z with six decimals, and one joint angle. The last two lines are files
with a mistake: one number in the last row, and every number.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from sixthlink.errors import InputError
from sixthlink.files import read_tracker_record

ROWS = 1_000_000

YAML = """\
schema: sixthlink-tracker/1
name: speed
instrument: simulated
units: {length: mm, angle: deg}
robot: {kinematics: none, label: table, joints: [turning]}
sigma: 0.02
reflectors: {R1: 1}
sweeps: {A1: 1}
tables:
  - file: points.txt
    reflector: R1
    columns: {x: X, y: Y, z: Z, point: Name, angle: q1}
    point_names: "{sweep}_{number}"
"""


def text_of(rows: list[list[str]], separator: str, mark: str) -> str:
    lines = [separator.join(["Name", "X", "Y", "Z", "q1"])]
    lines += [separator.join(row) for row in rows]
    text = "\n".join(lines) + "\n"
    return text if mark == "." else text.replace(".", mark)


def seconds(folder: Path, data: bytes) -> tuple[float, str]:
    """Processor time to read the record, and how it ended."""
    (folder / "points.txt").write_bytes(data)
    began = time.process_time()
    try:
        answer = f"{len(read_tracker_record(folder)):,} points"
    except InputError as error:
        answer = f"{len(error.findings)} findings"
    return time.process_time() - began, answer


def main() -> None:
    rng = np.random.default_rng(0)
    numbers = np.column_stack([rng.normal(0, 1500, (ROWS, 3)), rng.uniform(-170, 170, ROWS)])
    rows = [[f"A1_{i:07d}", *(f"{v:.6f}" for v in row)] for i, row in enumerate(numbers.tolist())]
    cases = {
        "comma": text_of(rows, ",", ".").encode(),
        "semicolon, decimal comma": text_of(rows, ";", ",").encode(),
        "tab, UTF-16": text_of(rows, "\t", ".").encode("utf-16"),
        "blanks": text_of(rows, " ", ".").encode(),
        "quoted names": text_of([[f'"{row[0]}"', *row[1:]] for row in rows], ",", ".").encode(),
        "one mistake at the end": text_of([*rows[:-1], [*rows[-1][:-1], "n/a"]], ",", ".").encode(),
        "mistakes everywhere": text_of([[*row[:-1], "n/a"] for row in rows], ",", ".").encode(),
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "tracker.yaml").write_text(YAML, encoding="utf-8")
        for case, data in cases.items():
            took, answer = seconds(folder, data)
            sys.stdout.write(f"{case:26} {len(data) / 2**20:6.1f} MiB {took:6.2f} s  {answer}\n")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    sys.stdout.write(f"peak memory of all this {peak:.0f} MiB\n")


if __name__ == "__main__":
    main()
