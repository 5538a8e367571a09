"""How does a failed validation read to the person who wrote the file?

The models say what is right; this module says what is wrong, in plain words, at the line and column where it
stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from sixthlink.errors import Finding
from sixthlink.files.yaml_marks import Keys, MarkedYaml, yaml_finding

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

__all__ = ["UNION_TAG", "did_you_mean", "one_of", "said", "validated"]

UNION_TAG = "tag:"
"""Tags of the members of a union begin with this, so that they can be told from keys of the file."""


def validated(type_: Any, marked: MarkedYaml, keys: Keys, examples: Mapping[str, str]) -> tuple[Any, list[Finding]]:
    """Part of a file as the type that its schema asks for.

    Args:
        type_: A pydantic model, or any type that pydantic validates.
        marked: The file.
        keys: Way to the part; it must exist.
        examples: One line of YAML per dotted key (``*`` for names that users choose): the keys that exist,
            and what to write where one is missing.

    Returns:
        The part, or None when there are findings; and the findings.
    """
    from pydantic import TypeAdapter, ValidationError

    value = value_at(marked.value, keys)
    try:
        return TypeAdapter(type_).validate_python(value), []
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=True)
        return None, [_finding(d, marked, keys, examples) for d in details]


def value_at(value: Any, keys: Keys) -> Any:
    """What stands at the end of a way, None where the way ends early."""
    for key in keys:
        try:
            value = value[key]
        except (KeyError, IndexError, TypeError):
            return None
    return value


def one_of(choices: Iterable[str], *, shown: Iterable[str] = ()) -> Callable[[Any], Any]:
    """Validator, to run before pydantic's own, of a text that must be one of some words.

    Args:
        choices: The words; a finding names the nearest.
        shown: What the finding lists, if not the words.
    """
    from pydantic_core import PydanticCustomError

    words = tuple(choices)
    expected = _listed(tuple(shown) or words)

    def check(value: Any) -> Any:
        if not isinstance(value, str) or value not in words:
            cure = did_you_mean(value, words) if isinstance(value, str) else ""
            raise PydanticCustomError("one_of", "{expected}", {"expected": expected, "cure": cure})
        return value

    return check


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """Hint at the words that look like this one, empty when none does."""
    by_lower = {w.lower(): w for w in words}
    near = get_close_matches(word.lower(), by_lower, n=3, cutoff=0.6)
    return f"did you mean {' or '.join(by_lower[n] for n in near)}?" if near else ""


def said(value: Any) -> str:
    """A value of a file in words: what the user wrote there."""
    if value is None:
        return "is empty"
    if isinstance(value, bool):
        return f"is {str(value).lower()}"
    if isinstance(value, str):
        return f"is the text '{value[:60]}'"
    if isinstance(value, list):
        return f"is a list of {len(value)}"
    if isinstance(value, dict):
        return "is a mapping"
    return f"is {str(value)[:60]}"


def _finding(error: ErrorDetails, marked: MarkedYaml, prefix: Keys, examples: Mapping[str, str]) -> Finding:
    kind, context = error["type"], error.get("ctx", {})
    way = [k for k in error["loc"] if not str(k).startswith(UNION_TAG)]
    if way and way[-1] == "[key]":
        what, expected = "cannot be used as a name", "letters, digits, - and _"
        return yaml_finding(marked, (*prefix, *way[:-1]), what, expected, "rename it", at_key=True)
    keys: Keys = (*prefix, *way)
    value = value_at(marked.value, keys)
    if kind == "missing":
        example = examples.get(_pattern(keys), "")
        cure = f'write it, for example "{example}"' if example else "write it"
        return yaml_finding(marked, keys, "is missing", "", cure, at_key=True)
    if kind == "extra_forbidden":
        words = _neighbours(keys, examples)
        cure = did_you_mean(str(keys[-1]), words) or "remove it"
        return yaml_finding(marked, keys, "is not a key of this file", _listed(words), cure, at_key=True)
    if kind == "one_of":
        cure = str(context["cure"]) or "write one of these"
        return yaml_finding(marked, keys, said(value), str(context["expected"]), cure)
    example = examples.get(_pattern(keys), "")
    cure = f'write for example "{example}"' if example else "correct it"
    if kind == "string_type" and value is not None and not isinstance(value, list | dict):
        cure = "put it in quotes"
    return yaml_finding(marked, keys, said(value), _expected(kind, context, error["msg"]), cure)


def _expected(kind: str, context: Mapping[str, Any], message: str) -> str:
    sizes = {k: context[k] for k in ("min_length", "max_length") if k in context}
    words = {
        "float_type": "a number",
        "finite_number": "a finite number",
        "int_type": "a whole number",
        "int_from_float": "a whole number",
        "bool_type": "true or false",
        "string_type": "a text",
        "string_too_short": "a text that is not empty",
        "list_type": "a list",
        "dict_type": "a mapping of keys to values",
        "model_type": "a mapping of keys to values",
        "too_short": f"a list of {sizes.get('min_length')}",
        "too_long": f"a list of {sizes.get('max_length')}",
        "greater_than": f"more than {context.get('gt', 0):g}" if "gt" in context else "",
        "greater_than_equal": f"at least {context.get('ge', 0):g}" if "ge" in context else "",
        "literal_error": str(context.get("expected", "")).replace("'", ""),
    }
    return words.get(kind) or message


def _pattern(keys: Keys) -> str:
    """Dotted keys with the names that users choose, and positions in lists, replaced."""
    parts = ["*" if k_before == "cameras" else str(k) for k_before, k in zip(("", *keys), keys, strict=False)]
    return ".".join(p for p, k in zip(parts, keys, strict=True) if not isinstance(k, int))


def _neighbours(keys: Keys, examples: Mapping[str, str]) -> list[str]:
    """Keys that may stand beside the last of these."""
    parent = _pattern(keys[:-1])
    start = f"{parent}." if parent else ""
    return [e.removeprefix(start) for e in examples if e.startswith(start) and "." not in e.removeprefix(start)]


def _listed(words: Iterable[str]) -> str:
    *most, last = words if isinstance(words, tuple) else tuple(words) or ("nothing",)
    return f"{', '.join(most)} or {last}" if most else last
