"""The house rules that a machine can watch."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import click
import pytest

import sixthlink
from sixthlink.cli.main import main

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "src" / "sixthlink").rglob("*.py"))
FRAME = re.compile(r"^Ts?_([a-z0-9]+)_([a-z0-9]+)$")


def test_the_front_door_lists_exactly_what_exists():
    assert sixthlink.__all__ == sorted(sixthlink.__all__)
    assert set(sixthlink._HOMES) == set(sixthlink.__all__)
    for name in sixthlink.__all__:
        assert getattr(sixthlink, name).__name__ == name


@pytest.mark.parametrize("module", ["sixthlink", "sixthlink.geometry", "sixthlink.robot", "sixthlink.cli.main"])
def test_light_rooms_load_neither_opencv_nor_scipy(module):
    code = f"import sys, {module}; print(sorted(m for m in ('cv2', 'scipy', 'pydantic', 'rich') if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_loads_no_numerics_at_all():
    code = (
        "import sys\nfrom sixthlink.cli.main import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('numpy', 'scipy', 'cv2', 'rich', 'pydantic', 'yaml') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("[]")


def frame_chain(node: ast.expr) -> list[tuple[str, str] | None]:
    """Frames of the factors of an ``@`` product; None for a factor whose name says no frames."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
        return frame_chain(node.left) + frame_chain(node.right)
    name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
    if isinstance(node, ast.Subscript):
        return frame_chain(node.value) if not isinstance(node.slice, ast.Tuple) else [None]
    match = FRAME.match(name)
    return [(match[1], match[2])] if match else [None]


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT / "src")))
def test_neighbouring_frames_cancel(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            chain = frame_chain(node)
            for left, right in pairwise(chain):
                if left and right:
                    assert left[1] == right[0], f"{path}:{node.lineno}: {left} @ {right}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT / "src")))
def test_rooms_stay_small_enough_to_hold_in_the_head(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 300
    assert not {"utils", "helpers", "common", "misc", "base", "manager"} & {path.stem, path.parent.name}


def every_command():
    """Every command by name; of a group, its subcommands."""
    for name, command in main.commands.items():
        if isinstance(command, click.Group):
            context = click.Context(command)
            yield from ((name, command.get_command(context, kind)) for kind in command.list_commands(context))
        else:
            yield name, command


@pytest.mark.parametrize(("name", "command"), list(every_command()), ids=lambda value: getattr(value, "name", value))
def test_every_command_explains_itself(name, command):
    assert command.help
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{name} {parameter.name}"
    assert any(p.name == "as_json" for p in command.params)
    assert name in (ROOT / "README.md").read_text(encoding="utf-8")
