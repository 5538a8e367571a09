"""What does a YAML file say, and at which line and column does it say it?

YAML 1.1 turns ``no`` into false, ``012`` into ten and ``12:30`` into 750, and leaves ``1e-3`` a text. Here a
plain scalar follows the core schema of YAML 1.2 instead (specification 1.2.2, section 10.3.2), every value
keeps its place in the file, and whatever would make a file say something else than it shows is refused: a key
written twice, anchors, aliases and tags.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from sixthlink.errors import Finding, InputError

__all__ = ["Keys", "MarkedYaml", "plain_scalar", "read_yaml", "yaml_finding", "yaml_from_text", "yaml_text"]

MOST_BYTES = 8 * 2**20
"""Largest YAML file that is read."""

DEEPEST = 32
"""Deepest nesting that is read; no file of ours needs more than 6."""

Keys = tuple[str | int, ...]
"""Way to a value: keys of mappings and positions in lists, from the top of the file."""

_INTEGER = re.compile(r"[-+]?[0-9]{1,400}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


@dataclass(frozen=True)
class MarkedYaml:
    """A YAML file and the places of its values.

    Attributes:
        where: Name of the file, for findings.
        value: Its content as mappings, lists, texts, numbers, booleans and None; the keys of mappings are
            texts.
        value_marks: One-based line and column at which each value begins.
        key_marks: The same for each key.
    """

    where: str
    value: Any
    value_marks: Mapping[Keys, tuple[int, int]]
    key_marks: Mapping[Keys, tuple[int, int]]


def yaml_finding(
    marked: MarkedYaml, keys: Keys, what: str, expected: str = "", cure: str = "", *, at_key: bool = False
) -> Finding:
    """Finding at a value of the file, or at its key; what is missing is placed at what should contain it."""
    first = marked.key_marks if at_key else marked.value_marks
    place = first.get(keys) or marked.value_marks.get(keys)
    parent = keys
    while place is None and parent:
        parent = parent[:-1]
        place = marked.key_marks.get(parent) or marked.value_marks.get(parent)
    line, column = place or (0, 0)
    return Finding(marked.where, dotted(keys), what, expected, cure, line, column)


def dotted(keys: Keys) -> str:
    """Keys as people write them, for example ``head.nominal.T_flange_head[0][3]``."""
    text = "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in keys)
    return text.removeprefix(".") or "file"


def read_yaml(path: Path) -> MarkedYaml:
    """Content and places of a YAML file.

    Raises:
        InputError: The file is missing, too large, not UTF-8, not YAML, or it uses what is refused here.
    """
    where = str(path)
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise InputError([Finding(where, "file", "is not a file", "a YAML file", "correct the path")])
        if size > MOST_BYTES:
            what = f"has {size} bytes"
            raise InputError([Finding(where, "file", what, f"at most {MOST_BYTES}", "check that it is the right file")])
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError([Finding(where, "file", "does not exist", "a YAML file", "correct the path")]) from None
    except OSError as error:
        cure = "check the rights of the file and its folder"
        raise InputError([Finding(where, "file", f"cannot be read ({error.strerror})", "", cure)]) from error
    except UnicodeDecodeError as error:
        what = f"byte {error.start + 1} is not UTF-8"
        raise InputError([Finding(where, "file", what, "UTF-8 text", "save the file as UTF-8")]) from error
    return yaml_from_text(text, where)


def yaml_from_text(text: str, where: str) -> MarkedYaml:
    """Content and places of YAML text.

    Args:
        text: The text.
        where: Name for findings.

    Raises:
        InputError: The text is not YAML, or it uses what is refused here.
    """
    findings: list[Finding] = []
    try:
        loader = _Loader(text, where, findings)
        node = loader.get_single_node()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        what = f"is not YAML: {', '.join(filter(None, [error.context, error.problem]))}"
        place = (mark.line + 1, mark.column + 1) if mark else (0, 0)
        cure = "correct the indentation, brackets or quotes there"
        raise InputError([Finding(where, "file", what, "", cure, *place)]) from error
    except yaml.YAMLError as error:
        what = f"has a character that YAML forbids ({str(error).splitlines()[0]})"
        raise InputError([Finding(where, "file", what, "plain text", "remove that character")]) from error
    value_marks: dict[Keys, tuple[int, int]] = {}
    key_marks: dict[Keys, tuple[int, int]] = {}
    places = _Places(where, value_marks, key_marks, findings)
    value = None if node is None else places.value_of(node, ())
    if findings:
        raise InputError(findings)
    return MarkedYaml(where, value, value_marks, key_marks)


def plain_scalar(text: str) -> bool | int | float | str | None:
    """What an unquoted scalar means in YAML 1.2."""
    if text in {"", "~", "null", "Null", "NULL"}:
        return None
    if text in {"true", "True", "TRUE", "false", "False", "FALSE"}:
        return text[0] in "tT"
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return float(text.lower().replace(".", ""))
    return text


def yaml_text(value: Any) -> str:
    """YAML text that reads back as the same value; innermost lists and mappings stand on one line."""
    return yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=10_000)


class _Loader(yaml.BaseLoader):
    """Composes nodes, all scalars as texts, and notes anchors and aliases instead of following them."""

    def __init__(self, text: str, where: str, findings: list[Finding]) -> None:
        super().__init__(text)
        self.where, self.findings, self.depth = where, findings, 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        mark: Any = event.start_mark
        line, column = mark.line + 1, mark.column + 1
        cure = "write the value out where it is used"
        if isinstance(event, yaml.AliasEvent):
            self.get_event()  # type: ignore[no-untyped-call]
            self.findings.append(Finding(self.where, f"*{event.anchor}", "is an alias", "", cure, line, column))
            return yaml.ScalarNode("tag:yaml.org,2002:str", "", mark, mark)
        if event.anchor is not None:
            self.findings.append(Finding(self.where, f"&{event.anchor}", "is an anchor", "", cure, line, column))
            event.anchor = None
        if getattr(event, "tag", None) is not None:
            self.findings.append(Finding(self.where, event.tag, "is a tag", "", "remove it", line, column))
        if self.depth == DEEPEST:
            raise yaml.MarkedYAMLError(None, None, f"nested deeper than {DEEPEST} levels", event.start_mark)
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


@dataclass(frozen=True)
class _Places:
    """Collects the places of values while nodes become values."""

    where: str
    value_marks: dict[Keys, tuple[int, int]]
    key_marks: dict[Keys, tuple[int, int]]
    findings: list[Finding]

    def value_of(self, node: yaml.Node, keys: Keys) -> Any:
        self.value_marks[keys] = _place(node)
        if isinstance(node, yaml.SequenceNode):
            return [self.value_of(item, (*keys, k)) for k, item in enumerate(node.value)]
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, keys)
        plain = isinstance(node, yaml.ScalarNode) and node.style is None
        return plain_scalar(node.value) if plain else node.value

    def _mapping(self, node: yaml.MappingNode, keys: Keys) -> dict[str, Any]:
        mapping: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                what = "has a key that is a list or a mapping"
                self.findings.append(
                    Finding(self.where, dotted(keys), what, "a text as key", "rename it", *_place(key_node))
                )
                continue
            key = key_node.value
            if key in mapping:
                line = self.key_marks[(*keys, key)][0]
                what, cure = f"is written twice, first in line {line}", "keep one of the two"
                self.findings.append(
                    Finding(self.where, dotted((*keys, key)), what, "each key once", cure, *_place(key_node))
                )
                continue
            self.key_marks[(*keys, key)] = _place(key_node)
            mapping[key] = self.value_of(value_node, (*keys, key))
        return mapping


def _place(node: yaml.Node) -> tuple[int, int]:
    return node.start_mark.line + 1, node.start_mark.column + 1


class _Dumper(yaml.SafeDumper):
    """Quotes every text that would otherwise read back as something else, and writes no aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _represent_text(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    stands_for_itself = isinstance(plain_scalar(text), str) and text.isprintable()
    style = None if stands_for_itself else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _represent_text)
