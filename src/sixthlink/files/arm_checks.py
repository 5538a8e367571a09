"""Which parts of an arm file contradict each other?

These checks look at the file as it stands, right or wrong in shape, so that their findings come together
with those about the shape.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from sixthlink.errors import Finding
from sixthlink.files.yaml_marks import Keys, MarkedYaml, yaml_finding

__all__ = ["arm_contradictions"]

MOST_JOINTS = 12
"""Arms with more joints than this are taken for a mistake."""


def arm_contradictions(marked: MarkedYaml) -> list[Finding]:
    """Where parts of the file disagree with each other; parts of the wrong shape are passed over here."""
    joints = _entries(marked, "joints")
    names = [entry.get("name") for _, entry in joints]
    listed = marked.value.get("joints") if isinstance(marked.value, dict) else None
    findings = []
    if isinstance(listed, list) and not 1 <= len(listed) <= MOST_JOINTS:
        what, cure = f"has {len(listed)} joints", "name the joints of the arm from base to flange"
        findings.append(yaml_finding(marked, ("joints",), what, f"1 to {MOST_JOINTS}", cure))
    findings += [
        yaml_finding(marked, (*keys, "name"), f"{name!r} names two joints", "a name of its own", "rename one")
        for (keys, _), name in zip(joints, names, strict=True)
        if isinstance(name, str) and names.count(name) > 1
    ]
    for keys, entry in joints:
        lower, upper = entry.get("lower"), entry.get("upper")
        if isinstance(lower, int | float) and isinstance(upper, int | float) and not lower < upper:
            what = f"has lower limit {lower} and upper limit {upper}"
            findings.append(yaml_finding(marked, keys, what, "lower below upper", "correct the limits"))
    findings += _section_findings(marked, len(joints))
    findings += _coupling_findings(marked, len(joints))
    return findings + _step_findings(marked, [name for name in names if isinstance(name, str)])


def _coupling_findings(marked: MarkedYaml, joint_count: int) -> list[Finding]:
    """Couplings that name joints which are not there, themselves, or the same pair again."""
    findings: list[Finding] = []
    pairs: list[tuple[Any, Any]] = []
    for keys, entry in _entries(marked, "couplings"):
        pair = entry.get("joint"), entry.get("driver")
        for key, number in zip(("joint", "driver"), pair, strict=True):
            if isinstance(number, int) and not 1 <= number <= joint_count:
                what, expected = f"names joint {number}", f"1 to {joint_count}"
                cure = "count the joints from 1 at the base"
                findings.append(yaml_finding(marked, (*keys, key), what, expected, cure))
        if pair[0] == pair[1]:
            cure = "use the joint's scale instead"
            findings.append(yaml_finding(marked, keys, "couples a joint with itself", "two joints", cure))
        if pair in pairs:
            what = f"couples joint {pair[0]} with {pair[1]} a second time"
            findings.append(yaml_finding(marked, keys, what, "each pair once", "keep one of the two"))
        pairs.append(pair)
    return findings


def _section_findings(marked: MarkedYaml, joint_count: int) -> list[Finding]:
    """Whether the file has the parts that its convention needs, and no others."""
    if not isinstance(marked.value, dict):
        return []
    convention = str(marked.value.get("convention"))
    tables = ("links", "flange", "couplings")
    wrong = {"steps": tables, "dh": ("steps",), "mdh": ("steps",)}.get(convention, ())
    findings = [
        yaml_finding(marked, (key,), f"does not belong to convention {convention}", "", "remove it", at_key=True)
        for key in wrong
        if key in marked.value
    ]
    needed = {"steps": "steps", "dh": "links", "mdh": "links"}.get(convention)
    if needed is not None and not marked.value.get(needed):
        what, cure = "is missing or empty", f"add it, or change the convention from {convention}"
        findings.append(yaml_finding(marked, (needed,), what, f"the {needed} of the arm", cure))
    links = marked.value.get("links")
    if needed == "links" and isinstance(links, list) and links and len(links) != joint_count:
        what = f"has {len(links)} rows for {joint_count} joints"
        cure = "give each joint its row; a fixed flange goes under flange"
        findings.append(yaml_finding(marked, ("links",), what, "one row per joint", cure))
    return findings


def _step_findings(marked: MarkedYaml, names: list[str]) -> list[Finding]:
    """Steps that name what does not exist, and joints that move nothing."""
    steps = _entries(marked, "steps")
    counts = Counter(str(entry.get("parameter")) for _, entry in steps)
    findings: list[Finding] = []
    last_kind: dict[str, tuple[Keys, Any]] = {}
    for keys, entry in steps:
        parameter, driven = entry.get("parameter"), entry.get("joints")
        if isinstance(parameter, str) and counts[parameter] > 1:
            what = f"{parameter!r} names {counts[parameter]} steps"
            findings.append(yaml_finding(marked, (*keys, "parameter"), what, "a name of its own", "rename it"))
        for name, factor in driven.items() if isinstance(driven, dict) else ():
            if name in names and factor:
                last_kind[name] = (keys, entry.get("kind"))
            elif names and name not in names:
                expected = f"one of {', '.join(names)}"
                findings.append(
                    yaml_finding(marked, (*keys, "joints", name), "is no joint", expected, "correct the name")
                )
    if steps:
        idle = [name for name in names if name not in last_kind]
        findings += [
            yaml_finding(marked, ("joints",), f"{name!r} moves no step", "", "name it under joints of a step")
            for name in idle
        ]
    if names and names[-1] in last_kind and last_kind[names[-1]][1] in {"rx", "ry", "tx", "ty"}:
        keys, kind = last_kind[names[-1]]
        cure = "turn the frame before and after this step so that the joint moves along z"
        findings.append(
            yaml_finding(marked, (*keys, "kind"), f"is {kind} for the last joint", "rz or tz, as the head's link", cure)
        )
    return findings


def _entries(marked: MarkedYaml, section: str) -> list[tuple[Keys, dict[str, Any]]]:
    """Places and entries of a list of mappings, whatever else is wrong with the file."""
    listed = marked.value.get(section) if isinstance(marked.value, dict) else None
    if not isinstance(listed, list):
        return []
    return [((section, k), entry) for k, entry in enumerate(listed) if isinstance(entry, dict)]
