"""A tracker record reads back as it was written, in whatever dialect: the same numbers, or a refusal, nothing else."""

import csv
import io
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sixthlink.errors import InputError
from sixthlink.files import load_arm, read_tracker_record, write_tracker_record, write_tracker_skeleton
from sixthlink.geometry import exp_rotation
from sixthlink.recording import ReferencePoints, Reflector, Sweep, TrackerRecord

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
RELATIVE = 1e-12
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}


def record(rng: np.random.Generator, *, poses: bool, times: bool, noise: str, arm: bool = True) -> TrackerRecord:
    M, K = 23, 4
    J = 6 if arm else 2
    sweep_of = np.sort(rng.integers(0, 3, M))
    sweep_of[:3] = 0, 1, 2
    known = np.repeat(rng.random((3, J)) < 0.6, 10, axis=0)[:M]
    covariances, ground = None, None
    if noise == "round":
        covariances, ground = np.tile(np.eye(3) * 4e-10, (M, 1, 1)), np.tile(np.eye(3) * 4e-10, (K, 1, 1))
    if noise == "full":
        A = rng.normal(0, 1e-5, (M + K, 3, 5))
        both = A @ A.swapaxes(1, 2)
        covariances, ground = both[:M], both[M:]
    odd = ["=1+1", "'=x", "-7", "@cmd", "#1", 'a "quoted", name', "ü 点;\ta", "\x1b[31mred", "// no comment", ""]
    return TrackerRecord(
        name="no: 5",
        instrument="=AT960",
        robot="ABB IRB 1400" if arm else "table",
        arm=load_arm("abb_irb1400", folder=Path()) if arm else None,
        sweeps=(Sweep("A1", 0), Sweep("=A2", 1), Sweep("012", None)),
        reflectors=(Reflector("no", J), Reflector("R,2", 2), Reflector("N1", 0)),
        points=rng.normal(0, 3, (M, 3)),
        names=tuple(odd[i % len(odd)] for i in range(M)),
        sweep_of=sweep_of,
        reflector_of=rng.permutation(np.arange(M) % 2),
        joints=np.where(known, rng.uniform(-0.3, 0.6, (M, J)), 0.0),
        joints_known=known,
        covariances=covariances,
        rotations=exp_rotation(rng.normal(size=(M, 3))) if poses else None,
        rotation_sigma_rad=1e-5 if poses else None,
        times_s=np.cumsum(rng.random(M)) if times else None,
        references=ReferencePoints(
            reflectors=np.full(K, 2),
            points=rng.normal(0, 3, (K, 3)),
            after=np.array([0, 5, 5, M]),
            covariances=ground,
            times_s=rng.random(K) if times else None,
        ),
    )


def assert_same(read: TrackerRecord, written: TrackerRecord) -> None:
    for name in ("name", "instrument", "robot", "sweeps", "reflectors", "names"):
        assert getattr(read, name) == getattr(written, name), name
    for name in ("points", "joints", "sweep_of", "reflector_of", "joints_known", "covariances", "rotations",
                 "oriented", "rotation_sigma_rad", "times_s"):  # fmt: skip
        same(getattr(read, name), getattr(written, name))
    assert (read.references is None) == (written.references is None)
    if read.references is not None and written.references is not None:
        for name in ("reflectors", "points", "after", "covariances", "times_s"):
            same(getattr(read.references, name), getattr(written.references, name))


def same(read: np.ndarray | float | None, written: np.ndarray | float | None) -> None:
    assert (read is None) == (written is None)
    if read is not None and written is not None:
        np.testing.assert_allclose(read, written, rtol=RELATIVE, atol=4e-16)


TABLE = {"kinematics": "none", "label": "table", "joints": ["turning", "turning"]}


@pytest.mark.parametrize("noise", ["none", "round", "full"])
@pytest.mark.parametrize("poses, times, arm", [(False, False, True), (True, True, True), (True, False, False)])
def test_written_record_reads_back(tmp_path: Path, noise: str, poses: bool, times: bool, arm: bool) -> None:
    for seed in range(2):
        written = record(np.random.default_rng(seed), poses=poses, times=times, noise=noise, arm=arm)
        robot = {"name": "abb_irb1400"} if arm else TABLE
        write_tracker_record(tmp_path, written, robot=robot, overwrite=True)
        read = read_tracker_record(tmp_path)
        assert_same(read, written)
        again = tmp_path / f"again{seed}"
        write_tracker_record(again, read, robot=robot)
        assert_same(read_tracker_record(again), written)
        for file in sorted(again.iterdir()):
            lines = file.read_text(encoding="utf-8").splitlines()
            assert not any(cell[:1] in set("=+@") for row in csv.reader(lines) for cell in row if file.suffix == ".csv")


POSITIONER = """\
schema: sixthlink-tracker/1
name: positioner
instrument: not known
units: {length: mm, angle: rad}
robot: {kinematics: none, label: two-axis positioner, joints: [turning, turning]}
sigma: unknown
reflectors: {probe: 2}
sweeps: {grid: free}
tables:
  - file: measurements.csv
    sweep: grid
    reflector: probe
    columns: {joints: [j1, j2], orientation: [qx, qy, qz, qw], time: stamp}
    orientation: quaternion-xyzw
    direction: T_tracker_reflector
    time: {unit: s}
"""


def test_real_poses_of_a_positioner_read_and_read_back(tmp_path: Path) -> None:
    source = DATA / "rosi_positioner_2axis" / "measurements.csv"
    if not source.is_file():
        message = "recorded data are not beside the repository (../shared/data)"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    (tmp_path / "measurements.csv").write_bytes(source.read_bytes())
    (tmp_path / "tracker.yaml").write_text(POSITIONER, encoding="utf-8")
    read = read_tracker_record(tmp_path)
    numbers = np.loadtxt(source, delimiter=",", skiprows=1)
    assert len(read) == 205 and read.rotations is not None
    np.testing.assert_allclose(read.points, numbers[:, 3:6] * 1e-3, rtol=RELATIVE)
    np.testing.assert_array_equal(read.joints, numbers[:, 1:3])
    qx, qy, qz, qw = numbers[:, 6:].T
    np.testing.assert_allclose(read.rotations[:, 0, 1], 2 * (qx * qy - qz * qw), atol=1e-9)
    write_tracker_record(tmp_path / "again", read, robot={**TABLE, "label": read.robot})
    assert_same(read_tracker_record(tmp_path / "again"), read)


def test_existing_record_is_kept_unless_told(tmp_path: Path) -> None:
    written = record(np.random.default_rng(5), poses=False, times=False, noise="none")
    write_tracker_record(tmp_path, written, robot={"name": "abb_irb1400"})
    with pytest.raises(InputError, match=r"tracker\.yaml: file: exists already"):
        write_tracker_record(tmp_path, written, robot={"name": "abb_irb1400"})


def test_skeleton_reads_as_it_is(tmp_path: Path) -> None:
    write_tracker_skeleton(tmp_path / "new")
    read = read_tracker_record(tmp_path / "new")
    assert [s.name for s in read.sweeps] == ["A1", "A2", "cloud"] and read.sweep_of.tolist() == [0, 0, 0, 1, 1, 2]
    assert read.references is not None and read.references.after.tolist() == [6]
    with pytest.raises(InputError, match=r"points\.csv: file: exists already"):
        write_tracker_skeleton(tmp_path / "new")


NUMBERS = st.one_of(
    st.floats(-5e3, 5e3, allow_nan=False, allow_subnormal=False),
    st.integers(-9999, 9999).map(float),
    st.integers(-99999, 99999).map(lambda n: n / 1000),
    st.sampled_from([0.0, 1.234, 123.456, -999.999, 1234.0, 12.5, 0.123, 1e-7, 1e6]),
)
FORMATS = {
    "shortest": repr,
    "three digits": lambda v: f"{v:.3f}",
    "whole": lambda v: f"{v:.0f}",
    "scientific": lambda v: f"{v:.9e}",
    "savetxt": lambda v: f"{v:.18e}",
    "thousands": lambda v: f"{v:,.3f}",
    "whole thousands": lambda v: f"{v:,.0f}",
}
HEADERS = {
    "English": ("Name", "X", "Y", "Z"),
    "German": ("Punktname", "X-Koordinate", "Y-Koordinate", "Z-Koordinate"),
    "French": ("Nom du point", "X [mm]", "Y [mm]", "Z [mm]"),
    "Italian": ("Nome punto", "x (mm)", "y (mm)", "z (mm)"),
    "Spanish": ("Nombre", "X_mm", "Y_mm", "Z_mm"),
    "Chinese": ("点名", "X坐标", "Y坐标", "Z坐标 [毫米]"),
}


@st.composite
def tables(draw: st.DrawFn) -> tuple[bytes, dict[str, str], np.ndarray]:
    """A table in some dialect, what tracker.yaml says of it, and its numbers."""
    count = draw(st.integers(1, 6))
    form = draw(st.sampled_from(sorted(FORMATS)))
    decimal = draw(st.sampled_from(["point", "comma"]))
    separator = draw(st.sampled_from(sorted(SEPARATORS)))
    if separator == decimal == "comma" and "thousands" in form:
        form = "shortest"  # nobody separates cells by commas and thousands by points
    numbers = np.array(draw(st.lists(NUMBERS, min_size=3 * count, max_size=3 * count))).reshape(-1, 3)
    texts = [[FORMATS[form](float(v)) for v in row] for row in numbers]
    plain = np.array([[float(t.replace(",", "")) for t in row] for row in texts])
    if decimal == "comma":
        texts = [[t.translate(str.maketrans(".,", ",.")) for t in row] for row in texts]
    header = draw(st.sampled_from([*sorted(HEADERS), ""]))
    quoting = draw(st.sampled_from([csv.QUOTE_MINIMAL, csv.QUOTE_ALL, csv.QUOTE_NONE]))
    text = io.StringIO()
    broken = quoting == csv.QUOTE_NONE and any(SEPARATORS[separator] in t for row in texts for t in row)
    if broken and not header and "thousands" in form:
        quoting = csv.QUOTE_MINIMAL  # nothing tells thousands from cells when both are cut by the same sign
    rows = [list(HEADERS[header])] if header else []
    if header in ("English", "German") and draw(st.booleans()):
        rows.append(["", "[mm]", "mm", "(mm)"])
    names = draw(st.lists(st.sampled_from(["A1_1", "A1_02", "A1_7"]), min_size=count, max_size=count))
    rows += [[name, *row] for name, row in zip(names, texts, strict=True)]
    if quoting == csv.QUOTE_NONE:
        text.write("".join(SEPARATORS[separator].join(row) + "\n" for row in rows))
    else:
        csv.writer(text, delimiter=SEPARATORS[separator], quoting=quoting, lineterminator="\n").writerows(rows)
    lines = text.getvalue()
    if draw(st.booleans()):
        lines = "// exported\n\n" + lines.replace("\n", "\n\n# remark\n")
    if draw(st.booleans()):
        lines = lines.replace("\n", "\r\n")
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]))
    said = {}
    if not header:
        said["header"] = "none"
    if draw(st.booleans()) and not broken:
        said["separator"] = separator
    if draw(st.booleans()):
        said["decimal"] = decimal
    return lines.encode(encoding), said, plain


SAID = """\
schema: sixthlink-tracker/1
name: any
instrument: any
units: {length: mm, angle: deg}
robot: {kinematics: none, label: table, joints: [turning]}
sigma: unknown
reflectors: {R1: 1}
sweeps: {A1: 1}
tables:
  - {file: points.txt, reflector: R1, point_names: "{sweep}_{number}"COLUMNSSAID}
"""


@settings(deadline=None, max_examples=150)
@given(tables())
@example((b"Name;X;Y;Z\nA1_1;1.234;2.345;3.456\n", {}, np.array([[1234.0, 2345.0, 3456.0]])))
@example((b"A1_1,1,5,2,5,3,5\n", {"header": "none"}, np.array([[1.5, 2.5, 3.5]])))
@example((b"A1_1 1,5 2,5 3,5\n", {"header": "none"}, np.array([[1.5, 2.5, 3.5]])))
@example((b"Name\tX\tY\tZ\nA1_1\t1,234\t2,345\t3,456\n", {}, np.array([[1.234, 2.345, 3.456]])))
def test_any_dialect_gives_the_same_numbers_or_is_refused(table: tuple[bytes, dict[str, str], np.ndarray]) -> None:
    data, said, numbers = table
    columns = ", columns: {point: 1, x: 2, y: 3, z: 4}" if "header" in said else ""
    more = "".join(f", {key}: {value}" for key, value in said.items())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "points.txt").write_bytes(data)
        (folder / "tracker.yaml").write_text(SAID.replace("COLUMNS", columns).replace("SAID", more), encoding="utf-8")
        try:
            read = read_tracker_record(folder)
        except InputError:
            return
    np.testing.assert_allclose(read.points * 1e3, numbers, rtol=RELATIVE, atol=1e-290)


@pytest.mark.parametrize("separator", SEPARATORS)
@pytest.mark.parametrize("decimal", ["point", "comma"])
@pytest.mark.parametrize("header", HEADERS)
def test_plain_dialects_are_read_and_not_only_refused(
    tmp_path: Path, separator: str, decimal: str, header: str
) -> None:
    numbers = np.array([[1994.294, 0.5, -27.4512], [-0.25, 1234.5678, 3.0]])
    mark = "," if decimal == "comma" else "."
    rows = [[f"{v:.6f}".replace(".", mark) for v in row] for row in numbers]
    text = io.StringIO()
    writer = csv.writer(text, delimiter=SEPARATORS[separator])
    writer.writerows([HEADERS[header], *(["A1_1", *row] for row in rows)])
    (tmp_path / "points.txt").write_text(text.getvalue(), encoding="utf-8")
    (tmp_path / "tracker.yaml").write_text(SAID.replace("COLUMNSSAID", ""), encoding="utf-8")
    np.testing.assert_allclose(read_tracker_record(tmp_path).points * 1e3, numbers, rtol=1e-9)


def test_plain_bytes_are_never_a_crash(tmp_path: Path) -> None:
    (tmp_path / "tracker.yaml").write_text(SAID.replace("COLUMNSSAID", ""), encoding="utf-8")

    @settings(deadline=None, max_examples=80)
    @given(
        st.one_of(
            st.binary(max_size=60), st.text("XYZName;,\t \"'#/%\n\r12.e-+\0\ufeff点", max_size=80).map(str.encode)
        )
    )
    def read(data: bytes) -> None:
        (tmp_path / "points.txt").write_bytes(data)
        with pytest.raises(InputError):
            read_tracker_record(tmp_path)

    read()
