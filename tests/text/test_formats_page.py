"""The page that explains the formats is true: its examples are read, its tables are complete."""

import re
from pathlib import Path

from example_recording import findings_of

from sixthlink.files import read_recording
from sixthlink.files.recording_schema import EXAMPLES, SECTIONS
from sixthlink.geometry import ORIENTATIONS
from sixthlink.target import TARGET_KINDS

PAGE = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")


def example(language: str, beginning: str) -> str:
    blocks = re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)
    (block,) = (b for b in blocks if b.startswith(beginning))
    return str(block)


def test_examples_are_a_recording(tmp_path: Path) -> None:
    (tmp_path / "recording.yaml").write_text(example("yaml", "schema"), encoding="utf-8")
    (tmp_path / "shots.csv").write_text(example("csv", "shot,placement"), encoding="utf-8")
    missing = findings_of(tmp_path)
    assert len(missing) == 9 and all("does not exist" in finding for finding in missing)
    (tmp_path / "images").mkdir()
    for name in re.findall(r"images/\w+\.png", "\n".join(missing)):
        (tmp_path / name).touch()
    assert read_recording(tmp_path).marks == ("", "", "", "A", "B")


def test_example_of_pixels_is_read(tmp_path: Path) -> None:
    recording = example("yaml", "schema").replace("observations: images", "observations: pixels")
    rows = [line.split(",")[:10] for line in example("csv", "shot,placement").splitlines()]
    shots = "".join(",".join(row) + "\n" for row in rows)
    (tmp_path / "recording.yaml").write_text(recording, encoding="utf-8")
    (tmp_path / "shots.csv").write_text(shots, encoding="utf-8")
    (tmp_path / "pixels.csv").write_text(example("csv", "shot,camera"), encoding="utf-8")
    pixels = read_recording(tmp_path).pixels
    assert pixels is not None and pixels.points.tolist() == [0, 1, 0] and pixels.shots.tolist() == [0, 0, 3]


def test_example_of_touches_is_read(tmp_path: Path) -> None:
    (tmp_path / "recording.yaml").write_text(example("yaml", "observations: touches"), encoding="utf-8")
    (tmp_path / "shots.csv").write_text(example("csv", "mark,shot"), encoding="utf-8")
    recording = read_recording(tmp_path)
    assert recording.touched and recording.marks == ("left", "left", "right", "left", "right")


def test_tables_name_every_section_key_orientation_and_target() -> None:
    for section in SECTIONS:
        assert f"| `{section}" in PAGE, section
    for key in {name.rsplit(".", 1)[-1] for name in EXAMPLES} - {"*"}:
        assert key in PAGE, key
    for name, orientation in ORIENTATIONS.items():
        if not name.startswith("euler-"):
            columns = " ".join(orientation.fields) if name != "matrix" else "r11 r12 r13 r21 … r33"
            assert f"| `{name}` | `{columns}` |" in PAGE, name
    for kind in TARGET_KINDS:
        assert f"| `{kind}` |" in PAGE, kind
