"""The page that explains tracker records is true: its example is read, its tables are complete."""

import re
from pathlib import Path

import numpy as np

from sixthlink.files import read_tracker_record, write_tracker_skeleton
from sixthlink.files.tracker_schema import TRACKER_EXAMPLES, TRACKER_SECTIONS

PAGE = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
SECTION = PAGE[PAGE.index("## Tracker records") :]


def test_example_is_a_record(tmp_path: Path) -> None:
    blocks = re.findall(r"```(?:yaml|csv|text)\n(.*?)```", SECTION, flags=re.DOTALL)
    names = ("", "tracker.yaml", "axes.csv", "cloud.txt", "joints.txt")
    for name, block in zip(names, blocks, strict=True):
        if name:
            (tmp_path / name).write_text(block, encoding="utf-8")
    record = read_tracker_record(tmp_path)
    assert record.names == ("A1_R1_01", "A1_R1_02", "A2_R2_01", "", "")
    assert record.sweep_of.tolist() == [0, 0, 1, 2, 2] and record.reflector_of.tolist() == [0, 0, 1, 0, 0]
    assert record.joints_known.sum(axis=1).tolist() == [1, 1, 1, 6, 6]
    np.testing.assert_allclose(record.points[2], [3.024451, 0.306943, 0.190202])
    assert record.oriented is not None and record.oriented.tolist() == [False] * 3 + [True] * 2
    assert record.references is not None and record.references.after.tolist() == [3]


def test_every_key_is_on_the_page_and_in_the_skeleton(tmp_path: Path) -> None:
    write_tracker_skeleton(tmp_path)
    skeleton = (tmp_path / "tracker.yaml").read_text(encoding="utf-8")
    for section in TRACKER_SECTIONS:
        assert f"`{section}" in SECTION, section
    for key in {name.rsplit(".", 1)[-1] for name in TRACKER_EXAMPLES}:
        assert key in SECTION or re.search(rf"\b{key}\b", PAGE), key
        assert re.search(rf"\b{key}\b", skeleton), key
