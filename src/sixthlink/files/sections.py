"""Which sections of recording.yaml have the right shape, and where are the findings of the others kept?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sixthlink.errors import Finding
from sixthlink.files.recording_schema import EXAMPLES, OF_A_HEAD, OPTIONAL, SECTIONS, TOUCHES
from sixthlink.files.schema_findings import did_you_mean, said, validated
from sixthlink.files.yaml_marks import Keys, MarkedYaml, yaml_finding

__all__ = ["Sections", "add_finding", "note_unknown_sections", "read_sections", "take_section"]


@dataclass(frozen=True)
class Sections:
    """Sections of one recording.yaml while it is judged.

    Attributes:
        marked: The file.
        valid: The sections whose shape is right, by key.
        findings: Everything found so far; grows while the sections are judged further.
    """

    marked: MarkedYaml
    valid: dict[str, Any] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    def written(self, key: str) -> bool:
        """Whether the file has this section, in whatever shape."""
        return isinstance(self.marked.value, dict) and key in self.marked.value


def add_finding(
    sections: Sections, keys: Keys, what: str, expected: str = "", cure: str = "", *, at_key: bool = False
) -> None:
    """Note a finding at a value of the file, or at its key."""
    sections.findings.append(yaml_finding(sections.marked, keys, what, expected, cure, at_key=at_key))


def read_sections(marked: MarkedYaml) -> Sections:
    """Sections of the right shape, each judged by itself."""
    sections = Sections(marked)
    if not isinstance(marked.value, dict):
        cure = "begin with a copy of the file that 'sixthlink init' writes"
        add_finding(sections, (), said(marked.value), "a mapping of sections", cure)
        return sections
    note_unknown_sections(sections, SECTIONS, "a recording")
    touched = marked.value.get("observations") == TOUCHES
    for key, type_ in SECTIONS.items():
        if touched and key in OF_A_HEAD:
            if key in marked.value:
                add_finding(sections, (key,), f"is not for observations: {TOUCHES}", "", "remove it", at_key=True)
            continue
        take_section(sections, key, type_, EXAMPLES, optional=key in OPTIONAL)
    return sections


def note_unknown_sections(sections: Sections, known: Mapping[str, Any], of_what: str) -> None:
    """Note every section of a mapping that its kind of file does not have."""
    for key in sections.marked.value:
        if key not in known:
            cure = did_you_mean(key, known) or "remove it"
            add_finding(sections, (key,), f"is not a section of {of_what}", ", ".join(known), cure, at_key=True)


def take_section(sections: Sections, key: str, type_: Any, examples: Mapping[str, str], *, optional: bool) -> None:
    """Keep a section whose shape is right; note what is wrong with it, or that it is missing."""
    if key in sections.marked.value:
        value, findings = validated(type_, sections.marked, (key,), examples)
        sections.findings.extend(findings)
        if not findings:
            sections.valid[key] = value
    elif not optional:
        add_finding(sections, (key,), "is missing", "", f'write it, for example "{examples[key]}"')
