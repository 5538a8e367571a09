"""What YAML can hide is refused or read as it stands, and broken YAML is placed."""

import math
from pathlib import Path

import pytest
from example_recording import RECORDING, changed, findings_of, write_example

from sixthlink.errors import InputError
from sixthlink.files.yaml_marks import plain_scalar, read_yaml, yaml_from_text

BREAK_CURE = "; correct the indentation, brackets or quotes there"

BROKEN = {
    "bracket": (
        ("angle: deg}", "angle: deg"),
        ["recording.yaml:4:6: file: is not YAML: while parsing a flow mapping, "
         "expected ',' or '}', but got ':'" + BREAK_CURE],
    ),
    "tabulator": (
        ("  name: abb", "\tname: abb"),
        ["recording.yaml:6:1: file: is not YAML: while scanning for the next token, "
         "found character '\\t' that cannot start any token" + BREAK_CURE],
    ),
    "key written twice": (
        ("mount: eye-in-hand", "mount: eye-in-hand\nmount: eye-to-hand"),
        ["recording.yaml:5:1: mount: is written twice, first in line 4, expected each key once; "
         "keep one of the two"],
    ),
    "anchor and alias": (
        ("name: example", "name: &n example\nx: *n"),
        ["recording.yaml:2:7: &n: is an anchor; write the value out where it is used",
         "recording.yaml:3:4: *n: is an alias; write the value out where it is used"],
    ),
    "tag": (
        ("name: example", "name: !!python/name:os.system x"),
        ["recording.yaml:2:7: tag:yaml.org,2002:python/name:os.system: is a tag; remove it"],
    ),
    "control character": (
        ("name: example", "name: exa\x07mple"),
        ["recording.yaml: file: has a character that YAML forbids (unacceptable character #x0007: "
         "special characters "
         "are not allowed), expected plain text; remove that character"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("change, messages", [pytest.param(*b, id=k) for k, b in BROKEN.items()])
def test_broken_yaml_is_placed(tmp_path: Path, change: tuple[str, str], messages: list[str]) -> None:
    assert findings_of(write_example(tmp_path, changed(RECORDING, change))) == messages


@pytest.mark.parametrize("text", ["", "- a list\n", "just words\n"])
def test_file_without_sections(tmp_path: Path, text: str) -> None:
    (finding,) = findings_of(write_example(tmp_path, text))
    assert finding.endswith(
        "expected a mapping of sections; begin with a copy of the file that 'sixthlink init' writes"
    )


@pytest.mark.parametrize(
    "text, value",
    [
        ("no", "no"), ("on", "on"), ("12:30", "12:30"), ("2024-01-01", "2024-01-01"), ("1_000", "1_000"),
        ("012", 12), ("0x1F", "0x1F"), ("1e-3", 1e-3), ("-.5", -0.5), ("+7", 7), ("1.", 1.0), (".", "."),
        ("true", True), ("False", False), ("yes", "yes"), ("null", None), ("~", None), ("nan", "nan"),
        (".inf", math.inf), ("-.INF", -math.inf), ("=", "="), ("<<", "<<"), ("1e5", 1e5), ("e5", "e5"),
    ],
)  # fmt: skip
def test_unquoted_scalars_follow_yaml_1_2(text: str, value: object) -> None:
    read = plain_scalar(text)
    assert read == value and type(read) is type(value)
    assert yaml_from_text(f"key: {text}", "x").value == {"key": value}
    assert yaml_from_text(f"key: '{text}'", "x").value == {"key": text}


def test_number_of_thousands_of_digits_is_not_finite() -> None:
    assert plain_scalar("9" * 5000) == math.inf


def test_deep_nesting_and_large_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nested deeper than 32 levels"):
        yaml_from_text("[" * 5000, "deep.yaml")
    large = tmp_path / "large.yaml"
    large.write_bytes(b"#" * (8 * 2**20 + 1))
    with pytest.raises(InputError, match="8388609 bytes, expected at most 8388608"):
        read_yaml(large)


def test_missing_and_mis_encoded_files(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"nothing\.yaml: file: does not exist, expected a YAML file; correct the path"
    ):
        read_yaml(tmp_path / "nothing.yaml")
    with pytest.raises(InputError, match="is not a file"):
        read_yaml(tmp_path)
    latin = tmp_path / "latin.yaml"
    latin.write_bytes("name: Zürich".encode("latin-1"))
    with pytest.raises(InputError, match="byte 8 is not UTF-8, expected UTF-8 text; save the file as UTF-8"):
        read_yaml(latin)
    bom = tmp_path / "bom.yaml"
    bom.write_text("name: Zürich", encoding="utf-8-sig")
    assert read_yaml(bom).value == {"name": "Zürich"}
