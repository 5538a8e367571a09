"""The report of a joint estimate: what it says of lengths, arm, noise and placements, word for word and with units."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_report import HOSTILE, calibration, length_check, recording, words

from sixthlink.calibrate import (
    ArmEvidence,
    BlockVerdict,
    Budget,
    Calibration,
    Correlation,
    HeldOut,
    JointEvidence,
    NoiseEvidence,
)
from sixthlink.files import result_as_dict
from sixthlink.report import report_page

STDS = (1.2e-5, 2.5e-5, 3.4e-5, 4e-5, 5e-5, 6e-5)
HEAD = ("head.x", "head.y", "head.z", "head.rotation_x", "head.rotation_y", "head.rotation_z")


def joint(names: str = "") -> JointEvidence:
    """A joint estimate of the test arm (1 mm and 0.05° are the maker's tolerances); ``names`` goes into every text."""
    free = ArmEvidence("a2" + names, "m", 0.6, 0.600386, 2.1e-5, free=True, reason="")
    arm = (
        ArmEvidence("theta1", "rad", 0.0, 0.0, np.radians(0.05), free=True, reason="the data add little" + names),
        free if names else replace(free, name="a2"),
        ArmEvidence("alpha2", "rad", 0.0, np.radians(0.0231), np.radians(0.0016), free=True, reason=""),
        ArmEvidence("d3", "m", 0.0, 0.0, 0.0, free=False, reason="the data cannot tell it from d2" + names),
        ArmEvidence("compliance_q2", "rad/m", 0.0, np.radians(-0.08), np.radians(0.023), free=True, reason=""),
    )
    budget = Budget(
        0.8127, 7316**0.5 * 1e-6, 4e-6, 5e-6, None, 1.1e-5, 3.5e-5, 7.7e-5, "the pixels rule: come closer" + names
    )
    noise = (
        NoiseEvidence("joints", "-", 1.03, 1.0),
        NoiseEvidence("pixels", "-", 1.0, 1.0),
        NoiseEvidence("across" + names, "m", 1.68e-4, None),
        NoiseEvidence("tilt", "rad", np.radians(0.135), None),
    )
    blocks = (BlockVerdict("compliance" + names, True, 0.332, 0.101), BlockVerdict("scale", False, -0.279, 0.112))
    return JointEvidence(
        unknowns=HEAD,
        covariance=np.diag(np.square(STDS)),
        arm=arm,
        blocks=blocks,
        noise=noise,
        chi2_per_dof=0.994,
        dof=270,
        correlations=(Correlation("right.fx" + names, "right.fy" + names, -0.9967),),
        placement_std=np.tile([2.5e-4, 3.4e-4, 3.9e-5, 3.3e-5, 3.4e-5, 5.2e-4], (2, 1)),
        budget=budget,
    )


def together(names: str = "", **changes: object) -> Calibration:
    """The calibration of the other tests, made jointly."""
    c = calibration(names)
    assert c.arm is not None
    arm = replace(
        c.arm, length_tolerance_m=1e-3, angle_tolerance_rad=np.radians(0.05), joint_repeatability_rad=np.radians(0.003)
    )
    return replace(c, **({"arm": arm, "joint": joint(names), "search": None, "solver": "joint"} | changes))  # type: ignore[arg-type]


def shown(**changes: object) -> str:
    return words(report_page(together(**changes), recording=recording()))


def test_the_headline_is_what_a_length_is_measured_to() -> None:
    text = shown()
    assert "± 0.086 mm standard uncertainty (k = 1) of a measured length of 813 mm, by the calibration’s own" in text
    assert "The pixels rule: come closer." in text
    assert "χ² per degree of freedom 0.99 (by chance 0.84 to 1.18)" in text
    assert "arm, head and placements estimated together" in text
    assert "Accuracy is unproven." in text


def test_certified_lengths_take_the_headline_and_the_own_account_becomes_a_fact() -> None:
    check = replace(length_check(), std_m=np.full(15, 2.1e-4))
    text = words(report_page(together(), recording=recording(), check=check))
    assert "3.529 mm → 0.417 mm" in text
    assert "a length of 813 mm is measured to ± 0.086 mm (k = 1)" in text
    assert "lengths inside their 95 % interval 9 of 15" in text


def test_held_out_shots_take_the_headline_where_no_length_can_be_told() -> None:
    held = HeldOut(38, 9.657e-4, np.radians(0.1976))
    text = shown(joint=replace(joint(), budget=None), heldout=held)
    assert "0.966 mm, 0.198° RMS error on 38 shots that the calibration has not seen" in text
    assert "Where the uncertainty comes from" not in text
    assert "held-out error, RMS 0.9657 mm, 0.1976° on 38 shots" in shown(heldout=held)


def test_the_budget_adds_up_to_the_whole() -> None:
    page = report_page(together(), recording=recording())
    text = words(page)
    for name, length, share in (
        ("joint repeatability", "0.0770 mm", "81.0 %"),
        ("arm geometry", "0.0350 mm", "16.7 %"),
        ("head", "0.0110 mm", "1.7 %"),
        ("lens", "0.0050 mm", "0.3 %"),
        ("pixels", "0.0040 mm", "0.2 %"),
    ):
        assert f"{name} {name}: {length}, {share} of the variance {length} {share}" in text
    assert "target not stated" in text
    assert "together 0.0855 mm 100.0 %" in text
    svg = next(e for e in ET.fromstring(page).iter("svg") if "Shares of the variance" in e.get("aria-label", ""))
    bars = [e for e in svg.iter("rect") if e.get("class", "").startswith("share")]
    rows: dict[str, list[ET.Element]] = {}
    for bar in bars:
        rows.setdefault(bar.get("y", ""), []).append(bar)
    whole = rows[max(rows, key=float)]
    assert len(rows) == 6 and len(whole) == 5
    starts = [float(bar.get("x", "0")) for bar in whole]
    ends = [start + float(bar.get("width", "0")) for start, bar in zip(starts, whole, strict=True)]
    # Each begins where the one before it ends; none is too small to be seen.
    assert ends[0] == pytest.approx(starts[1], abs=0.2)
    assert (ends[0] - starts[0]) / (ends[-1] - starts[0]) == pytest.approx(0.81, abs=0.005)
    assert min(end - start for start, end in zip(starts, ends, strict=True)) >= 1.4


def test_the_arm_says_what_changed_and_why_the_rest_did_not() -> None:
    text = shown()
    assert "4 of 5 parameters were estimated" in text
    assert "the maker’s tolerance (± 0.05° and ± 1 mm; assumed for optional parameters, shaded)" in text
    assert "parameter nominal calibrated change / std" in text
    assert "theta1 0° 0.000 ± 0.050° 0.0 the data add little" in text
    assert "a2 600 mm 600.386 ± 0.021 mm +18.4" in text
    assert "alpha2 0° 0.0231 ± 0.0016° +14.4" in text
    assert "d3 0 mm nominal the data cannot tell it from d2" in text
    assert "compliance_q2 0°/m −0.080 ± 0.023°/m −3.5" in text


def test_a_dot_lies_where_the_change_is_and_its_line_is_the_95_percent_interval() -> None:
    page = ET.fromstring(report_page(together(), recording=recording()))
    label = "theta1: change 0.000 ± 0.050°"
    svg = next(e for e in page.iter("svg") if e.get("aria-label", "").replace("\N{NO-BREAK SPACE}", " ") == label)
    band, zero = next(svg.iter("rect")), next(e for e in svg.iter("line") if e.get("class") == "axis")
    interval = next(e for e in svg.iter("line") if e.get("class") == "interval")
    assert next(svg.iter("circle")).get("cx") == zero.get("x1")
    half = (float(interval.get("x2", "0")) - float(interval.get("x1", "0"))) / 2
    # The standard deviation is the tolerance itself, so that the interval is 1.96 times the band.
    assert half == pytest.approx(1.96 * float(band.get("width", "0")) / 2, abs=0.2)


def test_head_placements_and_noise_carry_units() -> None:
    text = shown()
    assert "in the axes of the flange (k = 1)" in text
    assert "position along 0.012 mm 0.025 mm 0.034 mm turn about 0.0023° 0.0029° 0.0034°" in text
    assert "placement shots x [mm] y [mm] z [mm] ± about x, y, z [°] RMS [mm] RMS [°]" in text
    assert "place0 3 900.00 ± 0.25 100.00 ± 0.34 200.000 ± 0.039 0.0019, 0.0019, 0.030" in text
    assert "joint repeatability 0.00309°, 1.03 × stated 0.00300° by the robot’s file" in text
    assert "pixels 1.00 × stated by the images’ own residuals" in text
    assert "recorded poses, across the view 0.168 mm not stated" in text
    assert "recorded poses, tilt 0.135° not stated" in text
    assert "in the axes of the base (k = 1)" in words(
        report_page(together(mount="eye-to-hand"), recording=replace(recording(), mount="eye-to-hand"))
    )


def test_blocks_carry_the_verdict_of_shots_that_were_held_out() -> None:
    text = shown()
    assert "joints that yield to gravity +0.332 ± 0.101 entered" in text
    assert "joint scales −0.279 ± 0.112 left out" in text
    assert "Hardly told apart: 1 pair of unknowns with a correlation above 0.9" in text
    assert "right.fx right.fy −0.997" in text


def test_an_arm_without_stated_noise_is_told_so() -> None:
    arm = replace(together().arm, joint_repeatability_rad=0.0, length_tolerance_m=0.0)  # type: ignore[type-var]
    text = shown(arm=arm, joint=replace(joint(), noise=(NoiseEvidence("joints", "-", 2.0, None),)))
    assert re.search(r"joint repeatability 0\.0115° not stated", text)
    assert "± 2 mm (assumed)" in text


def test_table_ii_says_which_intervals_hold_the_certified_length() -> None:
    check = replace(length_check(), std_m=np.full(15, 2.1e-4))
    page = report_page(together(), recording=recording(), check=check)
    text = words(page)
    assert "before [mm] error [mm] after [mm] error [mm] ± std [mm] in 95 %" in text
    assert "1 r0 1237.2972 +3.1472 1233.7635 −0.3865 0.2100 yes" in text
    assert "4 r3 1238.2837 +4.1337 1234.6837 +0.5337 0.2100 no" in text
    assert "inside their 95 % interval – 9 of 15" in text
    plots = [e for e in ET.fromstring(page).iter("svg") if e.get("aria-label", "").startswith("Errors after")]
    (plot,) = plots
    zero = float(next(e.get("y1", "") for e in plot.iter("line") if e.get("class") == "axis"))
    bars = [e for e in plot.iter("line") if e.get("class") == "interval after"]
    # A length is inside its interval exactly where its bar crosses zero.
    crossing = [float(b.get("y1", "")) >= zero >= float(b.get("y2", "")) for b in bars]
    assert crossing == list(check.inside_95 if check.inside_95 is not None else ())


def test_the_head_alone_has_none_of_it() -> None:
    page = report_page(calibration(), recording=recording(), check=length_check())
    text = words(page)
    for absent in ("estimated together", "The arm", "The noise", "χ² per", "in 95 %", "Where the uncertainty", "± std"):
        assert absent not in text


def test_no_string_of_a_joint_result_breaks_out() -> None:
    page = report_page(together(HOSTILE), recording=recording(HOSTILE))
    tree = ET.fromstring(page)
    assert not [e for e in tree.iter() if e.tag in {"script", "img", "iframe", "object", "link"}]
    text = " ".join(tree.itertext())
    for start in ("a2", "the data add little", "cannot tell it from d2", "across", "compliance", "right.fx", "closer"):
        assert start + HOSTILE in text, start


def test_nothing_known_is_written_as_no_number() -> None:
    nothing = replace(joint(), arm=(), blocks=(), noise=(), correlations=(), dof=0, chi2_per_dof=float("nan"))
    still = replace(joint(), arm=(replace(joint().arm[0], std=0.0),))
    none = Budget(0.8, 0.0, 0.0, 0.0, None, 0.0, 0.0, 0.0, "")
    for changed in (nothing, still, replace(joint(), budget=none)):
        page = report_page(together(joint=changed), recording=recording())
        assert not re.search(r"\b(nan|inf)\b", page, re.IGNORECASE)
        assert "-0.0000" not in page


def test_every_key_of_a_joint_result_is_explained() -> None:
    page = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
    data = result_as_dict(together(heldout=HeldOut(3, 1e-3, 1e-3)))
    lists = [data["arm"]["parameters"], *(data["joint"][name] for name in ("noise", "blocks", "correlations"))]
    named = (data["budget"], data["joint"], data["heldout"], data["head"]["std"], *(rows[0] for rows in lists))
    for key in (key for keys in named for key in keys):
        assert re.search(rf"`(joint\.)?{key}(\[\])?`", page), key
