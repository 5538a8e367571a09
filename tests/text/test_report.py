"""The report: what it says, with which units, and that nothing in it can reach out or break out."""

from __future__ import annotations

import base64
import re
import time
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from sixthlink.calibrate import (
    BoardEvidence,
    Calibration,
    CameraEvidence,
    Certificate,
    Gate,
    SearchBox,
    SearchReport,
    ShotEvidence,
)
from sixthlink.camera import Camera, CameraRig
from sixthlink.geometry import inverse, transform
from sixthlink.measure import LengthCheck
from sixthlink.recording import CameraDescription, Detections, Head, Recording, Rejection
from sixthlink.report import report_page
from sixthlink.robot import (
    Arm,
    Joint,
    Link,
    PaperNumbers,
    arm_from_links,
    last_link,
    transform_from_paper_numbers,
)
from sixthlink.solvers import SwarmBudget
from sixthlink.target import Chessboard, LengthStandard, NotFound

TABLE_I = PaperNumbers(0.3516, 0.0901, 0.0727, 42.5612e-3, 191.3183e-3, 104.4643e-3)
RULER_M = 1.23415
BEFORE_MM = [
    *(1237.2972, 1238.2079, 1230.4198, 1238.2837, 1235.4735, 1230.1254, 1231.9349, 1234.6188),
    *(1238.7250, 1238.7988, 1230.7261, 1238.8559, 1238.7216, 1234.0037, 1237.1528),
]
AFTER_MM = [
    *(1233.7635, 1233.9874, 1234.4825, 1234.6837, 1234.5175, 1234.6745, 1233.7785, 1234.7293),
    *(1234.4971, 1234.6929, 1234.4561, 1234.6445, 1233.7637, 1234.5743, 1233.8869),
]
"""Table II of the paper."""

BOARD = Chessboard(5, 4, 0.02)
WIDTH, HEIGHT = 800, 600


def arm() -> Arm:
    rows = [
        (0, 475, 150, -90),
        (-90, 0, 600, 0),
        (0, 0, 120, -90),
        (0, 720, 0, 90),
        (0, 0, 0, -90),
        (180, 85, 0, 0),
    ]
    links = [Link(np.radians(t), d / 1e3, a / 1e3, np.radians(al)) for t, d, a, al in rows]
    joints = [Joint(f"q{k}", -3.0, 3.0) for k in range(1, 7)]
    return arm_from_links("test arm", "a drawing", "dh", links, joints)


def recording(names: str = "") -> Recording:
    """Two placements of three shots, two cameras; ``names`` is put into every string."""
    cameras = tuple(CameraDescription(c + names, WIDTH, HEIGHT) for c in ("right", "left"))
    T_flange_head = inverse(last_link(arm())) @ transform_from_paper_numbers(TABLE_I)
    rng = np.random.default_rng(0)
    return Recording(
        name="cell 7" + names,
        mount="eye-in-hand",
        robot="robot A" + names,
        arm=replace(arm(), name="test arm" + names, source="a drawing" + names),
        head=Head(cameras, T_flange_head),
        target=BOARD,
        standard=None,
        ids=tuple(f"shot{k}{names}" for k in range(6)),
        placements=tuple(f"place{k // 3}{names}" for k in range(6)),
        kinds=("calibrate",) * 6,
        marks=("",) * 6,
        joints=rng.uniform(-0.5, 0.5, (6, 6)),
    )


def calibration(names: str = "") -> Calibration:
    """An accepted calibration of that recording whose head is the paper's Table I."""
    of = recording(names)
    lens = Camera(
        WIDTH, HEIGHT, np.array([1200.5, 1201.25]), np.array([399.5, 299.5]), np.array([-0.08, 0.06, 0, 0, 0])
    )
    T_left_head = transform(np.eye(3), np.array([0.2, 0.0, 0.0]))
    evidence = CameraEvidence(True, 6, 0.081, np.array([0.31, 0.32, 0.4, 0.41, 4e-4, 3e-3, 2e-5, 2e-5, 0.0]))
    shots = [
        ShotEvidence(name, place, 1e-4 * (k + 1), 1e-5 * (k + 1), 0.06, 40, 0)
        for k, (name, place) in enumerate(zip(of.ids, of.placements, strict=True))
    ]
    T_base_target = transform(np.diag([1.0, -1.0, -1.0]), np.array([0.9, 0.1, 0.2]))
    return Calibration(
        recording=of.name,
        mount=of.mount,
        solver="paper" + names,
        X=of.head.nominal,
        arm=of.arm,
        rig=CameraRig(tuple(c.name for c in of.head.cameras), (lens, lens), np.stack([np.eye(4), T_left_head])),
        cameras=(evidence, evidence),
        stereo_rms_px=0.093,
        placements=tuple(dict.fromkeys(of.placements)),
        Ts_base_target=np.stack([T_base_target, T_base_target]),
        value_m2=3.2e-6,
        rotation_length_m=1.0,
        pairs=6,
        search=SearchReport("paper" + names, 11, SwarmBudget(8, 40, 1000), SearchBox(2.5), 4.1e-6, 3.2e-6, 7),
        certificate=Certificate(3.2e-6, 3.2e-6, 0.0, True, 0.1, False),
        shots=tuple(shots),
        rejections=(Rejection("shot9" + names, "left" + names, "too dark" + names),),
        gates=(Gate("enough shots" + names, True, "6 of 6" + names),),
        inputs={"recording.yaml" + names: "0123456789abcdef" * 4 + names},
        versions={"sixthlink" + names: "0.1.0" + names},
    )


def detections() -> Detections:
    """Every corner of the board, upright, 60 px apart, in every shot and camera."""
    count = len(BOARD.points_m)
    shots, cameras = np.repeat(np.arange(6), 2 * count), np.tile(np.repeat([0, 1], count), 6)
    pixels = np.tile(100.0 + 3000.0 * BOARD.points_m[:, :2], (12, 1))
    return Detections(shots, cameras, np.tile(np.arange(count), 12), pixels, np.full(len(shots), 0.05))


def length_check(names: str = "") -> LengthCheck:
    standard = LengthStandard(RULER_M, 3e-6, "quadrant", 0.024)
    places = tuple(f"r{k}{names}" for k in range(15))
    rejected = (Rejection("v3" + names, "", "mark not found" + names),)
    return LengthCheck(standard, places, np.array(BEFORE_MM) / 1e3, np.array(AFTER_MM) / 1e3, rejected)


def words(page: str) -> str:
    """What a reader sees, spaces made plain; parsing as XML proves that every element is closed."""
    body = ET.fromstring(page).find("body")
    assert body is not None
    return re.sub(r"\s+", " ", " ".join(t for t in body.itertext() if t.strip())).replace("\N{NO-BREAK SPACE}", " ")


def shown(**changes: object) -> str:
    return words(report_page(replace(calibration(), **changes), recording=recording()))


def test_headline_is_the_true_rms_of_the_papers_table_ii() -> None:
    text = words(report_page(calibration(), recording=recording(), check=length_check()))
    assert "3.529 mm → 0.417 mm" in text
    assert "RMS error of a certified length of 1234.1500 mm, measured at 15 placements" in text


@pytest.mark.parametrize(
    ("name", "before", "after"),
    [
        ("mean error", "+1.406", "+0.192"),
        ("mean absolute error", "3.212", "0.402"),
        ("RMS error", "3.529", "0.417"),
        ("standard deviation (n − 1)", "3.350", "0.383"),
        ("largest absolute error", "4.706", "0.579"),
    ],
)
def test_each_statistic_is_named_for_what_it_is(name: str, before: str, after: str) -> None:
    text = words(report_page(calibration(), recording=recording(), check=length_check()))
    found = re.search(re.escape(name) + r" ([+\d.]+) mm ([+\d.]+) mm", text)
    assert found
    for written, expected in zip(found.groups(), (before, after), strict=True):
        assert float(written) == pytest.approx(float(expected), abs=6e-4)
        assert written.startswith("+") == expected.startswith("+")


def test_table_ii_lists_every_placement() -> None:
    text = words(report_page(calibration(), recording=recording(), check=length_check()))
    assert "before [mm] error [mm] after [mm] error [mm]" in text
    assert "1 r0 1237.2972 +3.1472 1233.7635 −0.3865" in text
    assert "14 r13 1234.0037 −0.1463 1234.5743 +0.4243" in text


def test_the_head_carries_units_in_every_spelling() -> None:
    text = words(report_page(calibration(), recording=recording()))
    for symbol, value in {
        "α": "20.1452°",
        "β": "5.1623°",
        "γ": "4.1654°",
        "x": "42.5612 mm",
        "y": "191.3183 mm",
    }.items():
        assert f"{symbol} {value}" in text
    for value in (
        "0.351600 rad",
        "620.8887 mm",
        "−7.3767 mm",
        "552.3169 mm",
        "2.885049 rad",
        "−2.828364 rad",
    ):
        assert value in text


def test_the_matrix_can_be_copied_into_a_program() -> None:
    head = calibration()
    page = ET.fromstring(report_page(head, recording=recording()))
    T_flange_head_mm, T_link5_head_mm = (
        np.array([[float(v) for v in row.split()] for row in (pre.text or "").splitlines()]) for pre in page.iter("pre")
    )
    for written, T in ((T_flange_head_mm, head.X), (T_link5_head_mm, transform_from_paper_numbers(TABLE_I))):
        assert np.abs(written[:, :3] - T[:, :3]).max() < 1e-10
        assert np.abs(written[:3, 3] - T[:3, 3] * 1e3).max() < 1e-6


def test_every_figure_of_evidence_has_its_unit() -> None:
    text = words(report_page(calibration(), recording=recording()))
    for figure in (
        "0.3894 mm, 0.0022°",
        "1200.50 ± 0.31 px",
        "−0.08000 ± 0.00040",
        "0.000000 fixed",
        "0.081 px",
        "0.093 px",
        "baseline 200.000 mm",
        "3.20000 mm²",
        "±2500.0 mm",
        "7 of 8 swarms",
        "seed 11",
        "8 × 40 particles × 1000 iterations",
        "0123456789ab ",
    ):
        assert figure in text + " "


def test_a_refusing_gate_is_named_in_the_verdict() -> None:
    text = shown(gates=(Gate("enough shots", True, "6 of 6"), Gate("search agrees", False, "1 of 8 swarms; use more")))
    assert "✗ Refused Refused by “search agrees”: 1 of 8 swarms; use more." in text
    assert "✓ Accepted" not in text


def test_without_a_length_check_accuracy_is_called_unproven() -> None:
    text = shown()
    assert "Accuracy is unproven." in text
    assert "sixthlink verify FOLDER" in text
    assert "Verified on a length standard" not in text
    empty = replace(length_check(), placements=(), before_m=None, after_m=np.empty(0))
    text = words(report_page(calibration(), recording=recording(), check=empty))
    assert "Accuracy is unproven. No placement showed both marks" in text
    assert "mark not found" in text


def test_a_check_without_nominal_head_says_why_there_is_no_before() -> None:
    text = words(report_page(calibration(), recording=recording(), check=replace(length_check(), before_m=None)))
    assert "names no nominal head" in text
    assert "→ 0.417 mm" not in text
    assert "No. placement after [mm] error [mm]" in text


def test_a_fixed_camera_has_no_six_numbers() -> None:
    fixed = replace(recording(), mount="eye-to-hand")
    page = report_page(replace(calibration(), mount="eye-to-hand"), recording=fixed, detections=detections())
    text = words(page)
    assert "The camera in the base frame" in text
    assert "no six numbers" in text
    assert "T_base_head" in text
    assert "Sixth DH link" not in text


def test_recorded_poses_have_neither_cameras_nor_images() -> None:
    poses = replace(calibration(), rig=None, cameras=(), arm=None)
    of = replace(recording(), arm=None, joints=None, target=None, Ts_base_flange=np.tile(np.eye(4), (6, 1, 1)))
    page = report_page(poses, recording=of, read_image=lambda shot, camera: pytest.fail("no image is needed"))
    text = words(page)
    assert "What the cameras saw" not in text
    assert "focal" not in text
    assert " px" not in text
    assert "the controller’s flange stands in for link 5" in text


HOSTILE = "\"'><script>alert(1)</script><img src=x onerror=y>]]>&amp;{{ 7*7 }}"


def test_no_string_of_the_user_breaks_out() -> None:
    page = report_page(
        calibration(HOSTILE),
        recording=recording(HOSTILE),
        detections=detections(),
        read_image=lambda shot, camera: NotFound("gone" + HOSTILE),
        check=length_check(HOSTILE),
        created="today" + HOSTILE,
    )
    tree = ET.fromstring(page)
    assert not [e for e in tree.iter() if e.tag in {"script", "img", "iframe", "object", "link"}]
    assert not [name for e in tree.iter() for name in e.attrib if name.startswith("on")]
    text = " ".join(tree.itertext())
    for start in (
        "cell 7",
        "robot A",
        "shot5",
        "place0",
        "right",
        "enough shots",
        "6 of 6",
        "too dark",
        "r3",
        "today",
        "gone",
    ):
        assert start + HOSTILE in text, start
    assert "0123456789abcdef" * 4 + HOSTILE in [e.get("title") for e in tree.iter("code")]


def test_the_page_asks_nobody_for_anything() -> None:
    image = np.full((HEIGHT, WIDTH), 90, np.uint8)
    page = report_page(
        calibration(),
        recording=recording(),
        detections=detections(),
        read_image=lambda s, c: image,
        check=length_check(),
    )
    assert "http:" not in page
    assert "https:" not in page
    assert "url(" not in page
    assert "@import" not in page
    tree = ET.fromstring(page)
    references = [v for e in tree.iter() for name, v in e.attrib.items() if name in {"src", "href", "data", "action"}]
    assert len(references) > 0
    assert all(v.startswith("data:image/") for v in references)
    policy = next(e.get("content") for e in tree.iter("meta") if e.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None
    assert policy.startswith("default-src 'none'")


def test_points_are_drawn_where_they_were_found() -> None:
    page = report_page(
        calibration(),
        recording=recording(),
        detections=detections(),
        read_image=lambda s, c: NotFound("lost"),
    )
    svg = next(e for e in ET.fromstring(page).iter("svg") if "camera left" in e.get("aria-label", ""))
    # The first pixel's centre is (0, 0), so the picture begins half a pixel before it.
    assert svg.get("viewBox") == f"-0.5 -0.5 {WIDTH} {HEIGHT}"
    crosses = next(e.get("d", "") for e in svg.iter("path") if e.get("class") == "found")
    centres = {(float(u) + float(h) / 2, float(v)) for u, v, h in re.findall(r"M([\d.]+) ([\d.]+)h([\d.]+)", crosses)}
    assert centres == {(100.0 + 60.0 * column, 100.0 + 60.0 * row) for column in range(5) for row in range(4)}
    ring = next(svg.iter("circle"))
    assert (float(ring.get("cx", "0")), float(ring.get("cy", "0"))) == (100.0, 100.0)
    x, y = (next(e for e in svg.iter("text") if e.text == name) for name in "xy")
    assert float(x.get("x", "0")) > 280.0
    assert float(y.get("y", "0")) > 280.0
    assert "no image: lost" in words(page)


def test_images_become_small_and_keep_their_light() -> None:
    cv2 = pytest.importorskip("cv2")
    image = np.full((1500, 2000), 1000, np.uint16)
    image[:, 1000:] = 4000  # twelve bits in sixteen
    page = report_page(calibration(), recording=recording(), detections=detections(), read_image=lambda s, c: image)
    data = [v for e in ET.fromstring(page).iter("image") if (v := e.get("href")) is not None]
    # Worst, best and the worst of the other placement (which is the best's), two cameras each.
    assert 4 <= len(data) <= 12
    small = cv2.imdecode(np.frombuffer(base64.b64decode(data[0].split(",")[1]), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert small.shape == (480, 640)
    assert small[:, :300].mean() == pytest.approx(255 / 4, abs=4)
    assert small[:, 340:].mean() == pytest.approx(255, abs=4)


def test_what_is_known_of_the_target_is_told() -> None:
    board = BoardEvidence(1.0004, 0.0002, 3.7e-4, 5.8e-5, 1.2e-3, np.deg2rad(0.087))
    text = shown(board=board, print_sigma_m=5e-6)
    assert "1.00040 ± 0.00020 times the declared one, by the robot's motion" in text
    assert "0.370 ± 0.058 mm found in the images and corrected; taken as flat, the head would be 1.200 mm and" in text
    assert "0.0050 mm one sigma per coordinate" in text
    assert "found in the images and corrected" not in shown()


def test_a_turned_reading_is_drawn_from_the_right_end() -> None:
    symmetric = Chessboard(5, 3, 0.02)
    of = replace(recording(), target=symmetric)
    count = len(symmetric.points_m)
    pixels = 100.0 + 3000.0 * symmetric.points_m[:, :2]
    seen = Detections(np.zeros(count), np.zeros(count), np.arange(count), pixels, np.full(count, 0.05))
    turned = replace(calibration(), shots=(replace(calibration().shots[0], turns=1),))
    page = report_page(turned, recording=of, detections=seen)
    ring = next(e for e in ET.fromstring(page).iter("circle") if e.get("class") == "origin")
    assert (float(ring.get("cx", "0")), float(ring.get("cy", "0"))) == (340.0, 220.0)
    assert "read from another end" in words(page)


def test_no_number_is_ever_nan() -> None:
    nan = float("nan")
    broken = replace(calibration().shots[0], rms_px=nan)
    perfect = tuple(replace(s, translation_m=0.0, rotation_rad=0.0) for s in calibration().shots)
    one = replace(length_check(), placements=("r",), before_m=None, after_m=np.array([RULER_M]))
    for changed in (
        replace(calibration(), shots=(broken, *calibration().shots[1:])),
        replace(calibration(), shots=perfect, value_m2=0.0),
        replace(calibration(), shots=()),
    ):
        for check in (None, one):
            page = report_page(changed, recording=recording(), detections=detections(), check=check)
            assert not re.search(r"\b(nan|inf)\b", page, re.IGNORECASE)
            assert "-0.0000" not in page


def test_a_verification_elsewhere_draws_none_of_its_own_shots() -> None:
    elsewhere = replace(recording(), name="cell 8")
    text = words(report_page(calibration(), recording=elsewhere, detections=detections(), check=length_check()))
    assert "Verified on another recording: cell 8" in text
    assert "What the cameras saw" not in text


def test_the_page_is_small_and_quick() -> None:
    rng = np.random.default_rng(0)
    rows, columns = np.mgrid[0:1028, 0:1226]
    board = np.where((rows // 90 + columns // 90) % 2, 200.0, 40.0)
    image = np.clip(board + rng.normal(0.0, 2.0, board.shape), 0, 255).astype(np.uint8)
    begin = time.perf_counter()
    page = report_page(
        calibration(),
        recording=recording(),
        detections=detections(),
        read_image=lambda s, c: image,
        check=length_check(),
    )
    assert time.perf_counter() - begin < 3.0
    assert len(page.encode()) < 1_500_000
