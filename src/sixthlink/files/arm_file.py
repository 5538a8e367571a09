"""Which arm does a file, or the name of a known robot, mean?

An arm file names its units, its convention and its source; see ``docs/robots.md``. Files that the package
writes are in metres and radians with every digit, so that reading them back gives the same bits.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sixthlink.errors import Finding, InputError
from sixthlink.files.arm_checks import arm_contradictions
from sixthlink.files.atomic import atomic_write_text
from sixthlink.files.schema_findings import did_you_mean, validated
from sixthlink.files.yaml_marks import MarkedYaml, read_yaml, yaml_from_text, yaml_text
from sixthlink.robot import HARMONICS, Arm, Coupling, Joint, Link, Tolerances, arm_from_links, link_table_from_arm
from sixthlink.units import ANGLE_UNITS, LENGTH_UNITS

if TYPE_CHECKING:
    from sixthlink.files.arm_schema import ArmFile, StepEntry

__all__ = ["load_arm", "maker_names", "read_arm", "write_arm"]


def maker_names() -> list[str]:
    """Names of the robots that the package knows, sorted."""
    folder = resources.files("sixthlink.robot") / "makers"
    return sorted(file.name.removesuffix(".yaml") for file in folder.iterdir() if file.name.endswith(".yaml"))


def load_arm(reference: str, *, folder: Path) -> Arm:
    """The arm that a recording names.

    Args:
        reference: Name of a known robot, for example ``ur10e``, or path of an arm file.
        folder: Folder from which a relative path counts.

    Raises:
        InputError: The robot is not known and there is no such file, or the file is wrong.
    """
    names = maker_names()
    if reference in names:
        file = resources.files("sixthlink.robot") / "makers" / f"{reference}.yaml"
        return _arm_from_yaml(yaml_from_text(file.read_text(encoding="utf-8"), f"{reference}.yaml"))
    path = folder / reference
    if path.is_file():
        return read_arm(path)
    hint = did_you_mean(reference, names)
    what = f"{reference!r} is neither a known robot nor a file"
    expected = f"one of {', '.join(names)}, or the path of an arm file"
    cure = f"{hint} or else " if hint else ""
    cure += "describe the robot in an arm file (docs/robots.md) and give its path"
    raise InputError([Finding(str(path), "robot", what, expected, cure)])


def read_arm(path: Path) -> Arm:
    """The arm of an arm file.

    Raises:
        InputError: Everything that is wrong with the file, each with line, column and cure.
    """
    return _arm_from_yaml(read_yaml(path))


def write_arm(path: Path, arm: Arm) -> None:
    """Write an arm file in metres and radians, DH tables as tables and everything else as steps.

    Reading it back gives the same steps, joint map, names, limits and tolerances, bit for bit.

    Args:
        path: File to create or replace, all of it or nothing.
        arm: The arm.

    Raises:
        ValueError: The arm says that it is a DH table and is none.
        OSError: The folder cannot be written.
    """
    from sixthlink.files.arm_schema import SCHEMA

    content: dict[str, Any] = {
        "schema": SCHEMA,
        "name": arm.name,
        "source": arm.source,
        "units": {"length": "m", "angle": "rad"},
        "convention": arm.dialect,
    }
    content |= _steps_content(arm) if arm.dialect == "steps" else _table_content(arm)
    for entry, waves, compliance in zip(content["joints"], arm.harmonics, arm.compliance.tolist(), strict=True):
        if waves.any():
            entry["harmonics"] = dict(zip(HARMONICS, waves.tolist(), strict=True))
        if compliance:
            entry["compliance"] = compliance
    content["tolerances"] = {
        "length": float(arm.length_tolerance_m),
        "angle": float(arm.angle_tolerance_rad),
        "joint_repeatability": float(arm.joint_repeatability_rad),
    }
    atomic_write_text(path, yaml_text(content))


def _table_content(arm: Arm) -> dict[str, Any]:
    table = link_table_from_arm(arm)
    links = [{"theta": r.theta_rad, "d": r.d_m, "a": r.a_m, "alpha": r.alpha_rad} for r in table.links]
    for entry, row in zip(links, table.links, strict=True):
        if row.beta_rad is not None:
            entry["beta"] = row.beta_rad
    content: dict[str, Any] = {"joints": [_joint_content(joint) for joint in table.joints], "links": links}
    if table.flange:
        content["flange"] = dict(zip(("x", "y", "z", "yaw", "pitch", "roll"), table.flange, strict=True))
    if table.couplings:
        content["couplings"] = [vars(coupling) for coupling in table.couplings]
    return content


def _joint_content(joint: Joint) -> dict[str, Any]:
    optional = {
        "direction": joint.direction if joint.direction != 1 else None,
        "sliding": joint.sliding or None,
        "scale": joint.scale if joint.scale != 1.0 else None,
    }
    written = {key: value for key, value in optional.items() if value is not None}
    return {"name": joint.name, "lower": joint.lower, "upper": joint.upper} | written


def _steps_content(arm: Arm) -> dict[str, Any]:
    sliding = [not arm.turns[arm.joint_map[:, j] != 0.0].any() for j in range(len(arm.joints))]
    joints = [
        _joint_content(Joint(name, lower, upper, sliding=slides))
        for name, (lower, upper), slides in zip(arm.joints, arm.limits.tolist(), sliding, strict=True)
    ]
    steps = []
    for kind, name, value, row in zip(
        arm.kinds, arm.parameters, arm.values.tolist(), arm.joint_map.tolist(), strict=True
    ):
        step = {"kind": kind, "parameter": name, "value": value}
        driven = {joint: factor for joint, factor in zip(arm.joints, row, strict=True) if factor != 0.0}
        steps.append(step | {"joints": driven} if driven else step)
    return {"joints": joints, "steps": steps}


def _arm_from_yaml(marked: MarkedYaml) -> Arm:
    from sixthlink.files.arm_schema import EXAMPLES, ArmFile

    file, findings = validated(ArmFile, marked, (), EXAMPLES)
    findings += arm_contradictions(marked)
    if findings:
        raise InputError(sorted(findings, key=lambda f: (f.line, f.column)))
    length, angle = LENGTH_UNITS[file.units.length], ANGLE_UNITS[file.units.angle]
    t = file.tolerances
    tolerances = Tolerances(t.length * length, t.angle * angle, t.joint_repeatability * angle)
    units = [length if joint.sliding else angle for joint in file.joints]
    joints = [
        Joint(j.name, j.lower * unit, j.upper * unit, j.direction, j.sliding, j.scale)
        for j, unit in zip(file.joints, units, strict=True)
    ]
    if file.steps is not None:
        arm = _arm_from_steps(file, file.steps, joints, units, tolerances)
    else:
        arm = _arm_from_table(file, joints, units, tolerances)
    return replace(
        arm,
        harmonics=np.array([[getattr(j.harmonics, wave) for wave in HARMONICS] for j in file.joints]) * angle,
        compliance=np.array([j.compliance for j in file.joints]) * (angle / length),
    )


def _arm_from_table(file: ArmFile, joints: list[Joint], joint_units: list[float], tolerances: Tolerances) -> Arm:
    length, angle = LENGTH_UNITS[file.units.length], ANGLE_UNITS[file.units.angle]
    links = [
        Link(
            row.theta * angle,
            row.d * length,
            row.a * length,
            row.alpha * angle,
            None if row.beta is None else row.beta * angle,
        )
        for row in file.links or []
    ]
    couplings = [
        # Where a turn follows a slide, the factor is an angle per length: both units matter.
        Coupling(c.joint, c.driver, c.factor * (joint_units[c.joint - 1] / joint_units[c.driver - 1]))
        for c in file.couplings
    ]
    f = file.flange
    flange = (
        [] if f is None else [f.x * length, f.y * length, f.z * length, f.yaw * angle, f.pitch * angle, f.roll * angle]
    )
    return arm_from_links(
        file.name,
        file.source,
        file.convention,
        links,
        joints,
        couplings=couplings,
        flange=flange,
        tolerances=tolerances,
    )


def _arm_from_steps(
    file: ArmFile,
    steps: list[StepEntry],
    joints: list[Joint],
    joint_units: list[float],
    tolerances: Tolerances,
) -> Arm:
    length, angle = LENGTH_UNITS[file.units.length], ANGLE_UNITS[file.units.angle]
    step_units = [angle if step.kind[0] == "r" else length for step in steps]
    names = [joint.name for joint in joints]
    joint_map = np.zeros((len(steps), len(joints)))
    for k, step in enumerate(steps):
        for name, factor in step.joints.items():
            j = names.index(name)
            motion = factor * joints[j].direction * joints[j].scale
            joint_map[k, j] = motion * (step_units[k] / joint_units[j])
    return Arm(
        name=file.name,
        source=file.source,
        dialect="steps",
        kinds=tuple(step.kind for step in steps),
        parameters=tuple(step.parameter for step in steps),
        values=np.array([step.value * unit for step, unit in zip(steps, step_units, strict=True)]),
        joint_map=joint_map,
        joints=tuple(names),
        limits=np.array([[joint.lower, joint.upper] for joint in joints]),
        length_tolerance_m=tolerances.length_m,
        angle_tolerance_rad=tolerances.angle_rad,
        joint_repeatability_rad=tolerances.joint_repeatability_rad,
    )
