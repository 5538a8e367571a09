"""Which sections of recording.yaml have the right shape, and where are the findings of the others kept?"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from sixthlink.errors import Finding
from sixthlink.files.recording_schema import EXAMPLES, OF_A_HEAD, OPTIONAL, SECTIONS, TOUCHES
from sixthlink.files.schema_findings import did_you_mean, said, validated
from sixthlink.files.yaml_marks import Keys, MarkedYaml, yaml_finding

__all__ = ["Sections", "add_finding", "read_sections"]


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
    for key in marked.value:
        if key not in SECTIONS:
            cure = did_you_mean(key, SECTIONS) or "remove it"
            add_finding(sections, (key,), "is not a section of a recording", ", ".join(SECTIONS), cure, at_key=True)
    touched = marked.value.get("observations") == TOUCHES
    for key, type_ in SECTIONS.items():
        if touched and key in OF_A_HEAD:
            if key in marked.value:
                add_finding(sections, (key,), f"is not for observations: {TOUCHES}", "", "remove it", at_key=True)
            continue
        if key in marked.value:
            value, findings = validated(type_, marked, (key,), EXAMPLES)
            sections.findings.extend(findings)
            if not findings:
                sections.valid[key] = value
        elif key not in OPTIONAL:
            add_finding(sections, (key,), "is missing", "", f'write it, for example "{EXAMPLES[key]}"')
    return sections
