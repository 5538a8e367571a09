"""The report of an arm from a tracker record: what it says and draws, with units, and that nothing in it breaks out."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_report import HOSTILE, words

from sixthlink.calibrate import Correlation, Gate
from sixthlink.calibrate.tracked_arm import (
    JointSweep,
    PointErrors,
    RecordFinding,
    TrackedArm,
    calibrate_arm_by_tracker,
)
from sixthlink.calibrate.tracker import CircleFinding
from sixthlink.files import load_arm
from sixthlink.progress import Silent
from sixthlink.recording import Rejection, TrackerRecord
from sixthlink.report import tracked_page
from sixthlink.report.circle_scene import along_arc, circle_plot, evenly
from sixthlink.report.tracked_figures import MOST_PANELS, deviation_plot, heldout_plot
from sixthlink.simulate import SCENARIOS, TrackerSession, simulate_tracking

Job = tuple[TrackedArm, TrackerRecord]


@pytest.fixture(scope="module")
def job() -> Job:
    """A small session of an arm with a parallelogram, two points of it wrong."""
    session = TrackerSession(stops=12, free_points=30, outliers=2)
    nominal = load_arm("abb_irb1400", folder=Path())
    record = simulate_tracking(SCENARIOS["paper"], session, nominal, seed=0).record
    return calibrate_arm_by_tracker(record, Silent(), versions={"sixthlink": "9.8.7"}), record


def shown(job: Job, **changes: object) -> str:
    return words(tracked_page(replace(job[0], **changes), job[1]))  # type: ignore[arg-type]


def parts(drawing: str, tag: str, role: str) -> list[ET.Element]:
    """Elements of a drawing whose first class is ``role``."""
    return [e for e in ET.fromstring(drawing).iter(tag) if e.get("class", "").split(" ")[0] == role]


def grid(job: Job, sweeps: int) -> TrackedArm:
    """The same, as if every sweep had been found so many times in free measurements."""
    return replace(job[0], sweeps=tuple(replace(s, implied=True) for s in job[0].sweeps for _ in range(sweeps)))


def test_the_headline_is_the_error_at_poses_that_no_fit_had_seen(job: Job) -> None:
    result, text = job[0], shown(job)
    assert f"{1e3 * result.heldout_before.rms_m:.3f} mm → {1e3 * result.heldout.rms_m:.3f} mm" in text
    assert f"RMS error at {len(result.used)} points before and after" in text
    assert "every one was predicted by fits that had not seen its pose" in text
    assert "Before is the nominal arm" in text


def test_facts_carry_units_and_the_coupling_its_uncertainty(job: Job) -> None:
    result, record = job
    text = shown(job)
    (coupling,) = result.couplings
    assert f"points used {len(result.used)} of {len(record)} sweeps 6" in text
    assert f"largest held-out error {1e3 * result.heldout.max_m:.3f} mm" in text
    assert f"χ² per degree of freedom, as stated {result.joint.chi2_per_dof:.2f}" in text
    found = re.search(rf"{coupling.name}, a factor −([\d.]+) ± ([\d.]+)", text)
    assert found
    assert float(found[1]) == pytest.approx(-coupling.value, abs=coupling.std)
    assert float(found[2]) == pytest.approx(coupling.std, rel=0.05)
    assert "sweeps 6, 6 of them within free measurements" in words(tracked_page(grid(job, 1), record))


def test_every_gate_finding_and_rejection_is_on_the_page(job: Job) -> None:
    result, text = job[0], shown(job)
    assert result.findings and result.rejections and "✓ Accepted" in text
    for gate in result.gates:
        assert f"✓ {gate.name} {gate.message}" in text
    for f in result.findings:
        assert f"{f.where}, {f.finding.kind}: {f.finding.words}" in text
    for rejection in result.rejections:
        assert f"{rejection.shot} {rejection.reason}" in text
    assert "every point was used" in shown(job, rejections=())


def test_a_grave_finding_is_a_notice_and_a_refusal_is_told(job: Job) -> None:
    grave = RecordFinding("A4", CircleFinding("two axes", "another joint moved; sweep again"))
    page = tracked_page(
        replace(job[0], findings=(grave, *job[0].findings), gates=(Gate("sweeps are circles", False, "A4"),)), job[1]
    )
    notices = [" ".join(e.itertext()) for e in ET.fromstring(page).iter("p") if e.get("class") == "notice grave"]
    assert [re.sub(r"\s+", " ", n) for n in notices] == ["A4, two axes: another joint moved; sweep again."]
    assert "✗ Refused ✗ sweeps are circles A4" in words(page)


def test_every_circle_is_told_in_millimetres_degrees_and_milliradians(job: Job) -> None:
    result, record = job
    text = shown(job)
    for head in ("radius [mm]", "arc [°]", "radial RMS [mm]", "plane RMS [mm]", "direction ± [mrad]"):
        assert head in text
    for sweep in result.sweeps:
        assert sweep.fit is not None
        (circle,), fit = sweep.fit.circles, sweep.fit
        (reflector,) = {record.reflectors[k].name for k in record.reflector_of[sweep.rows]}
        joint, kept = result.arm.joints[sweep.joint], f"{fit.kept.sum()} of {len(fit.kept)}"
        row = re.search(rf"{sweep.name} {joint} {reflector} {kept} ([\d.]+) ± ([\d.]+) ([\d. ]+)", text)
        assert row, sweep.name
        assert float(row[1]) == pytest.approx(1e3 * circle.radius_m, abs=1e-2)
        arc, radial, plane, direction = (float(v) for v in row[3].split())
        assert arc == pytest.approx(np.rad2deg(fit.arcs_rad[0]), abs=0.06)
        assert (radial, plane) == pytest.approx((1e3 * fit.radial_rms_m, 1e3 * fit.plane_rms_m), abs=6e-5)
        assert direction == pytest.approx(1e3 * fit.direction_uncertainty_rad, rel=0.06)


def test_every_axis_has_its_direction_and_its_doubt(job: Job) -> None:
    text = shown(job)
    assert "joint x [–] y [–] z [–] ± [mrad] ± [mm]" in text
    for axis in job[0].axes:
        assert axis.sweep is not None
        x, y, z = (f"{v:.6f}".replace("-", "−") for v in axis.axis.direction.tolist())
        row = re.search(rf"{axis.joint} {x} {y} {z} ([\d.]+) ([\d.]+) {axis.sweep.name}", text)
        assert row, axis.joint
        assert float(row[1]) == pytest.approx(1e3 * axis.direction_std_rad, rel=0.06)
        assert float(row[2]) == pytest.approx(1e3 * axis.position_std_m, rel=0.06)
    alone = replace(job[0].axes[0], sweep=None, direction_std_rad=np.inf)
    assert re.search(r"q1 [−\d. ]+ not seen [\d.]+ no sweep: all points", shown(job, axes=(alone,)))


def test_errors_before_and_after_stand_side_by_side(job: Job) -> None:
    before, after = job[0].heldout_before, job[0].heldout
    text = shown(job)
    assert f"RMS error {1e3 * before.rms_m:.4f} mm {1e3 * after.rms_m:.4f} mm" in text
    assert f"largest error {1e3 * before.max_m:.4f} mm {1e3 * after.max_m:.4f} mm" in text
    assert "orientation, RMS" not in text
    turned = replace(after, turns_rad=np.radians([0.03, 0.05]))
    both = shown(job, heldout=turned, heldout_before=replace(before, turns_rad=np.radians([0.3, 0.5])))
    assert "orientation, RMS of 2 0.4123° 0.0412°" in both


def test_every_parameter_of_the_arm_is_listed(job: Job) -> None:
    text = shown(job)
    arm = text[text.index("The arm, before and after") : text.index("The noise")]
    for p in job[0].joint.arm:
        assert f" {p.name} " in arm, p.name
        assert p.reason in arm
    assert "No drawing was given" not in text


def test_noise_blocks_and_close_correlations_are_explained(job: Job) -> None:
    text = shown(job)
    assert "tracker’s points 1.00 × stated by the record" in text
    assert all(name in text for name in ("joint scales", "periodic joint errors", "joints that yield to gravity"))
    pairs = tuple(Correlation(f"one{k}", f"other{k}", 0.999 - 0.001 * k) for k in range(14))
    text = shown(job, joint=replace(job[0].joint, correlations=pairs))
    assert "14 pairs of unknowns with a correlation above 0.9, the closest 10 here" in text
    assert "one9 other9 +0.990" in text and "one10" not in text


def test_an_arm_without_a_drawing_says_so(job: Job) -> None:
    text = shown(job, drawn=False)
    assert "No drawing was given. The nominal arm is what the axes alone show" in text
    assert "Before is the arm that the axes alone show" in text


def test_a_reflector_that_is_not_seen_is_named(job: Job) -> None:
    first, second = job[0].reflectors
    assert re.search(
        rf"{first.name} 6 \(flange\) 159\.\d+ ± [\d.]+ [\d.]+ ± [\d.]+ [\d.]+ ± [\d.]+ nothing", shown(job)
    )
    hidden = replace(second, std_m=np.array([1e-5, 1e-5, np.inf]), unseen="along (0.00, 0.00, 1.00)")
    text = shown(job, reflectors=(first, hidden))
    assert re.search(rf"{second.name} 2 −[\d.]+ ± [\d.]+ [\d.]+ ± [\d.]+ not seen along \(0\.00, 0\.00, 1\.00\)", text)


def test_a_sweep_without_a_circle_says_why(job: Job) -> None:
    first, *others = job[0].sweeps
    none = replace(first, fit=None, findings=(CircleFinding("sliding joint", "a line", {}, grave=False),))
    text = shown(job, sweeps=(none, *others))
    assert f"A1 q1 R1 0 of {len(first.rows)} – – – – – sliding joint" in text
    text = shown(job, sweeps=())
    assert "The record holds no sweep of one joint" in text
    assert "How far the points lie beside their circles" not in text


def test_nothing_known_is_written_as_no_number(job: Job) -> None:
    result = job[0]
    nowhere = tuple(replace(a, direction_std_rad=np.inf, position_std_m=np.inf) for a in result.axes)
    unseen = tuple(replace(r, std_m=np.full(3, np.inf), unseen="along x") for r in result.reflectors)
    nothing = replace(result.joint, arm=(), blocks=(), noise=(), chi2_per_dof=float("nan"))
    exact = PointErrors(np.zeros(len(result.used)), np.zeros(0))
    one = replace(result, axes=nowhere, reflectors=unseen, joint=nothing)
    for changed in (one, replace(result, heldout=exact, heldout_before=exact)):
        page = tracked_page(changed, job[1])
        assert not re.search(r"\b(nan|inf)\b", page, re.IGNORECASE)
        assert "-0.0000" not in page


def test_a_reflector_of_which_nothing_is_left_has_no_numbers(job: Job) -> None:
    (first, *others), record = job[0].sweeps, job[1]
    fit, half = first.fit, len(first.rows) // 2
    assert fit is not None
    second = np.arange(len(first.rows)) >= half
    fit = replace(
        fit,
        circles=2 * fit.circles,
        covariance=np.eye(8) * 1e-10,
        reflectors=second.astype(np.int64),
        kept=~second,
        arcs_rad=np.array([1.0, 0.0]),
    )
    two = record.reflector_of.copy()
    two[first.rows[second]] = 1
    result = replace(job[0], sweeps=(replace(first, fit=fit), *others))
    page = tracked_page(result, replace(record, reflector_of=two))
    assert not re.search(r"\b(nan|inf)\b", page, re.IGNORECASE)
    assert f"A1 q1 L2 0 of {len(first.rows) - half} " in words(page)
    assert re.search(r"A1 q1 L2 0 of \d+ [\d.]+ ± [\d.]+ 0\.0 – – [\d.]+", words(page))


def test_the_page_reaches_out_to_nothing_and_no_string_breaks_out(job: Job) -> None:
    result, record = job
    joints = tuple(name + HOSTILE for name in result.arm.joints)
    finding = CircleFinding("kind" + HOSTILE, "words" + HOSTILE, {}, grave=False)
    sweeps = tuple(replace(s, name=s.name + HOSTILE, findings=(finding,)) for s in result.sweeps)
    hostile = replace(
        result,
        record="<b>left cell</b>" + HOSTILE,
        instrument="tracker" + HOSTILE,
        arm=replace(result.arm, name="arm" + HOSTILE, source="source" + HOSTILE, joints=joints),
        sweeps=sweeps,
        axes=tuple(replace(a, joint=j, sweep=s) for a, j, s in zip(result.axes, joints, sweeps, strict=True)),
        reflectors=tuple(replace(r, name=r.name + HOSTILE, unseen="unseen" + HOSTILE) for r in result.reflectors),
        findings=(RecordFinding("where" + HOSTILE, finding), RecordFinding("where", replace(finding, grave=True))),
        gates=(Gate("gate" + HOSTILE, False, "message" + HOSTILE),),
        rejections=(Rejection("point" + HOSTILE, "", "reason" + HOSTILE),),
        inputs={"tracker.yaml" + HOSTILE: "0123456789abcdef"},
        versions={"sixthlink": "9.8.7" + HOSTILE},
    )
    of = replace(record, reflectors=tuple(replace(r, name=r.name + HOSTILE) for r in record.reflectors))
    page = tracked_page(hostile, of, created="today" + HOSTILE)
    tree = ET.fromstring(page)
    assert not [e for e in tree.iter() if e.tag in {"script", "img", "iframe", "object", "link", "a"}]
    assert not [n for e in tree.iter() for n in e.attrib if n.startswith("on") or n.endswith(("href", "src"))]
    assert not re.search(r"https?://|url\(", tracked_page(result, record))
    text = " ".join(tree.itertext())
    names = ("tracker", "arm", "source", "q1", "A1", "R1", "unseen", "where", "kind", "words", "gate", "message")
    for start in (*names, "point", "reason", "tracker.yaml", "9.8.7", "today", "<b>left cell</b>"):
        assert start + HOSTILE in text, start
    assert "0123456789ab" in text


def test_measured_points_lie_on_the_arcs_that_are_drawn(job: Job) -> None:
    result, record = job
    plot = circle_plot(result, record)
    arcs, wholes = parts(plot, "polyline", "arc"), parts(plot, "polygon", "round")
    assert len(arcs) == len(wholes) == 6
    for sweep, arc in zip(result.sweeps, arcs, strict=True):
        path = np.array([[float(v) for v in p.split(",")] for p in arc.get("points", "").split()])
        role = arc.get("class", "").split(" ")[1]
        dots = [e for e in parts(plot, "circle", "swept") if e.get("class") == f"swept {role}"]
        at = np.array([[float(e.get("cx", "")), float(e.get("cy", ""))] for e in dots])
        steps = np.diff(path, axis=0)
        along = np.einsum("nki,ki->nk", at[:, None] - path[:-1], steps) / np.maximum(np.sum(steps**2, axis=1), 1e-9)
        feet = path[:-1] + np.clip(along, 0.0, 1.0)[..., None] * steps
        near = np.linalg.norm(at[:, None] - feet, axis=2).min(axis=1) < 0.5
        assert sweep.fit is not None
        assert np.count_nonzero(near) >= sweep.fit.kept.sum()


def test_the_scene_shows_every_point_once_and_marks_what_was_left_out(job: Job) -> None:
    result, record = job
    plot = circle_plot(result, record)
    dots = len(parts(plot, "circle", "swept")) + len(parts(plot, "circle", "free"))
    crosses = len(parts(plot, "path", "left-out"))
    assert crosses == len(record) - len(result.used) == 2
    assert dots + crosses == len(record)
    assert len(parts(plot, "polyline", "joint-axis")) == 6
    text = " ".join(ET.fromstring(plot).itertext())
    assert "tracker" in text and "base" in text and "floor grid 500" in text
    assert all(joint in text for joint in result.arm.joints)


def test_of_many_points_and_many_sweeps_only_some_are_drawn(job: Job) -> None:
    result, record = job
    each = np.repeat(np.arange(len(record)), 40)
    many = replace(
        record,
        **{name: getattr(record, name)[each] for name in ("points", "sweep_of", "reflector_of", "joints")},
        **{name: getattr(record, name)[each] for name in ("joints_known", "oriented", "covariances")},
        names=("",) * len(each),
        references=None,
    )
    free = replace(result, sweeps=(), used=tuple(range(len(each))))
    assert 2900 <= circle_plot(free, many).count("<circle") <= 3000
    plot = circle_plot(grid(job, 9), record)
    assert len(parts(plot, "polyline", "arc")) == 6 * 6
    assert deviation_plot(grid(job, 9), record).count("RMS radial") == MOST_PANELS


def test_a_circle_that_cannot_be_believed_is_not_completed(job: Job) -> None:
    first, *others = job[0].sweeps
    bad = replace(first, findings=(CircleFinding("short arc", "too short"),))
    result = replace(job[0], sweeps=(bad, *others))
    plot = circle_plot(result, job[1])
    assert len(parts(plot, "polygon", "round")) == 5 and len(parts(plot, "polyline", "arc")) == 6
    assert "A1 (not usable)" in deviation_plot(result, job[1])


def test_deviations_are_drawn_to_scale_with_their_rms(job: Job) -> None:
    result, record = job
    plot = deviation_plot(result, record)
    text = re.sub(r"\s+", " ", " ".join(ET.fromstring(plot).itertext()))
    found = re.findall(r"RMS radial ([\d.]+), plane ([\d.]+) µm", text)
    fits = [s.fit for s in result.sweeps if s.fit is not None]
    for (radial, plane), fit in zip(found, fits, strict=True):
        assert (float(radial), float(plane)) == pytest.approx((1e6 * fit.radial_rms_m, 1e6 * fit.plane_rms_m), rel=6e-3)
    dots = [e for e in parts(plot, "circle", "dot") if e.get("class") == "dot radial g0"]
    heights = np.array([float(e.get("cy", "")) for e in dots])
    slope, level = np.polyfit(fits[0].deviations_m[fits[0].kept, 0], heights, 1)
    assert np.abs(heights - level - slope * fits[0].deviations_m[fits[0].kept, 0]).max() < 0.1
    assert slope < 0.0  # outwards is up
    assert len(parts(plot, "path", "left-out")) == sum(int((~fit.kept).sum()) for fit in fits)


def test_the_error_curves_pass_their_medians(job: Job) -> None:
    result = job[0]
    plot = heldout_plot(result)
    text = " ".join(ET.fromstring(plot).itertext()).replace("\N{NO-BREAK SPACE}", " ")
    for name, errors in (("before", result.heldout_before), ("after", result.heldout)):
        (curve,) = [e for e in parts(plot, "polyline", "curve") if e.get("class") == f"curve {name}"]
        path = np.array([[float(v) for v in p.split(",")] for p in curve.get("points", "").split()])
        assert (np.diff(path[:, 0]) >= 0.0).all() and (np.diff(path[:, 1]) <= 0.0).all()
        median, largest = (e for e in parts(plot, "circle", "dot") if e.get("class") == f"dot {name}")
        near = np.interp(float(median.get("cy", "")), path[::-1, 1], path[::-1, 0])
        assert near == pytest.approx(float(median.get("cx", "")), abs=4.0)
        assert float(largest.get("cy", "")) == pytest.approx(path[-1, 1], abs=0.1)
        written = [float(v) for v in re.findall(r"([\d.]+) mm", text)]
        for value in (np.median(errors.distances_m), errors.max_m):
            assert any(v == pytest.approx(1e3 * value, rel=6e-3) for v in written)


def test_an_arc_begins_after_the_largest_gap(job: Job) -> None:
    sweep = job[0].sweeps[0]
    assert isinstance(sweep, JointSweep) and sweep.fit is not None
    start, along = along_arc(sweep.fit.circles[0], job[1].points[sweep.rows], sweep.fit.kept)
    kept = along[sweep.fit.kept]
    assert 0.0 <= start < 2.0 * np.pi
    assert kept.min() == 0.0
    assert kept.max() == pytest.approx(float(sweep.fit.arcs_rad[0]), abs=1e-9)


def test_an_even_choice_keeps_both_ends() -> None:
    assert evenly(5, 9).tolist() == [0, 1, 2, 3, 4]
    assert evenly(101, 3).tolist() == [0, 50, 100]
    assert evenly(0, 3).tolist() == [] and evenly(4, 0).tolist() == []
