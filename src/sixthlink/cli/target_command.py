"""Which command prints a target?

One subcommand per kind of target, its options made from the fields of the kind's dataclass: a field ``square_m`` is the
option ``--square`` in millimetres, and its help is what the class says of it. The kinds are looked at only when
somebody asks for one, because they bring the numerics with them.
"""

from __future__ import annotations

import inspect
import re
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any, get_type_hints

import click

from sixthlink.cli.command import FILE, command
from sixthlink.cli.console import print_json

__all__ = ["target"]

_LENGTH = click.FloatRange(min=0.0, min_open=True)


class _Kinds(click.Group):
    """The kinds of targets, each made into a command when it is asked for."""

    def list_commands(self, _context: click.Context) -> list[str]:
        from sixthlink.target import TARGET_KINDS

        return list(TARGET_KINDS)

    def get_command(self, _context: click.Context, name: str) -> click.Command | None:
        from sixthlink.target import TARGET_KINDS

        return _kind_command(name, TARGET_KINDS[name]) if name in TARGET_KINDS else None


@click.group(cls=_Kinds, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
def target() -> None:
    """Print a calibration target at true scale: a PDF, and the line for recording.yaml.

    \b
    Examples:
      sixthlink target chessboard --pdf board.pdf --columns 12 --rows 9 --square 20
      sixthlink target charuco --help                                  what a kind asks for
    """  # noqa: D301 - click wants the backspace character itself


def _kind_command(kind: str, class_: type[Any]) -> click.Command:
    """The command that prints one kind of target."""
    from sixthlink.export import PAPERS_MM
    from sixthlink.units import MM

    def run(pdf: Path, *, paper: str | None, as_json: bool, **values: Any) -> int:
        wanted = {f.name: values[_key(f)] * MM if _is_length(f) else values[_key(f)] for f in _fields(class_)}
        return _print(_made(kind, class_, wanted), pdf, paper, as_json=as_json)

    summary = inspect.getdoc(class_) or kind
    decorators = [
        click.option("--pdf", type=FILE, required=True, help="File to write."),
        *(_option(class_, f) for f in _fields(class_)),
        click.option(
            "--paper", type=click.Choice(list(PAPERS_MM)), help="Paper.  [default: the smallest of the A series]"
        ),
    ]
    function: Any = run
    for decorate in reversed(decorators):
        function = decorate(function)
    return command(name=kind, help=f"{summary.splitlines()[0]}\n\nPrinted at true scale; lengths are in mm.")(function)


def _fields(class_: type[Any]) -> list[Field[Any]]:
    return [f for f in fields(class_) if f.init]


def _is_length(field: Field[Any]) -> bool:
    return field.name.endswith("_m")


def _key(field: Field[Any]) -> str:
    """What the user calls a field: its name without the unit."""
    return field.name.removesuffix("_m")


def _option(class_: type[Any], field: Field[Any]) -> Any:
    """The option of one field."""
    kind = get_type_hints(class_)[field.name]
    text = _meanings(class_).get(field.name, _key(field)).replace("``", "").replace("[m]", "[mm]")
    text = text.removeprefix("True ") if kind is bool else text
    name, required = f"--{_key(field).replace('_', '-')}", field.default is MISSING
    settings: dict[str, Any] = {"required": required, "help": text[:1].upper() + text[1:]}
    if not required:
        settings |= {"default": field.default, "show_default": True}
    if kind is bool:
        return click.option(name, _key(field), is_flag=True, **settings)
    return click.option(name, _key(field), type=_LENGTH if _is_length(field) else kind, **settings)


def _meanings(class_: type[Any]) -> dict[str, str]:
    """What the class's docstring says of each of its attributes."""
    _, _, listed = (inspect.getdoc(class_) or "").partition("Attributes:\n")
    joined = re.sub(r"\n {5,}", " ", listed)
    return dict(re.findall(r"^ {4}(\w+): (.+)$", joined, re.MULTILINE))


def _made(kind: str, class_: type[Any], values: dict[str, Any]) -> Any:
    """The target that was asked for, or what is wrong with the options."""
    from sixthlink.errors import Finding, InputError

    try:
        return class_(**values)
    except ValueError as problem:
        words = str(problem)
        named = [
            f"--{_key(f).replace('_', '-')}"
            for f in _fields(class_)
            if any(_says(words, word) for word in (_key(f), _shown(values[f.name])))
        ]
        where = ", ".join(named) or "options"
        raise InputError([Finding(f"target {kind}", where, words, "", "")]) from problem


def _says(text: str, word: str) -> bool:
    """Whether a word stands in a text by itself."""
    return bool(word and re.search(rf"(?<![\w.]){re.escape(word)}(?![\w.])", text))


def _shown(value: Any) -> str:
    """How an error of a class shows a value; a switch is named by its name alone."""
    return "" if isinstance(value, bool) else str(value)


def _yaml(value: Any) -> str:
    """A value as ``recording.yaml`` has it; a text that looks like a number, or several, needs its quotes."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value if re.fullmatch(r"[A-Za-z][\w-]*", value) else f'"{value}"'
    return f"{value:.10g}"


def _print(made: Any, pdf: Path, paper: str | None, *, as_json: bool) -> int:
    """Write the file and say what it holds."""
    from sixthlink.units import MM
    from sixthlink.workflow.target import print_target, target_keys

    page, outcome = print_target(made, pdf, paper=paper)
    files = {name: str(path) for name, path in outcome.files.items()}
    points = len(made.points_m)
    if as_json:
        print_json({"files": files, "points": points, "paper": page.paper, "check_length_m": page.check_mm * MM})
    else:
        keys = ", ".join(f"{key}: {_yaml(value)}" for key, value in target_keys(made).items())
        click.echo(f"{points} points on {page.paper}; on the print the check line must be {page.check_mm:g} mm long")
        click.echo(f"recording.yaml, with millimetres as unit of length:\n  target: {{{keys}}}")
        click.echo(f"wrote {pdf}")
    return 0
