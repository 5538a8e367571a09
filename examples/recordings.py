"""How do real recordings become sixthlink recordings? A few lines each; the data stay where they are.

    python examples/recordings.py DATA OUT

writes OUT/<name>/ for every data set found under DATA. Images are linked by copying them into the recording.
"""

from __future__ import annotations

import csv
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

MATRIX = [f"r{i}{j}" for i in "123" for j in "123"]
HEADER = "schema: sixthlink-recording/1\nname: {name}\nunits: {{length: mm, angle: {angle}}}\nmount: {mount}\n"
NO_STANDARD = "length_standard: none\n"


def matrices(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Name and (x, y, z, r11 ... r33) of every 4×4 row of a table."""
    with path.open(newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    for name, *m in rows[1:]:
        yield name, [m[3], m[7], m[11], *m[0:3], *m[4:7], *m[8:11]]


def write(folder: Path, description: str, columns: list[str], rows: list[list[str]]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recording.yaml").write_text(description, encoding="utf-8")
    with (folder / "shots.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["shot", "placement", "kind", *columns], *rows])
    return folder


def denso_tabb_ds1(data: Path, out: Path) -> Path:
    """Images of a chessboard, camera in the hand, flange poses as matrices."""
    description = (
        HEADER.format(name="denso_tabb_ds1", angle="deg", mount="eye-in-hand")
        + "robot: {kinematics: none, label: Denso VS-6577GM-B, positions: flange-poses, orientation: matrix,\n"
        "  direction: T_base_flange}\n"
        "head: {reference: camera, cameras: {camera: {image_size_px: [640, 480], intrinsics: calibrate}}}\n"
        "target: {kind: chessboard, columns: 8, rows: 6, square: 28.5}\n" + NO_STANDARD + "observations: images\n"
    )
    return with_images(data / "denso_tabb_ds1", out / "denso_tabb_ds1", description)


def rosi_charuco_static_camera(data: Path, out: Path) -> Path:
    """Images of a ChArUco board on the flange, seen by a fixed camera."""
    description = (
        HEADER.format(name="rosi_charuco_static_camera", angle="deg", mount="eye-to-hand")
        + "robot: {kinematics: none, label: ABB, positions: flange-poses, orientation: matrix,\n"
        "  direction: T_base_flange}\n"
        "head: {reference: camera, cameras: {camera: {image_size_px: [1600, 1200], intrinsics: calibrate}}}\n"
        "target: {kind: charuco, columns: 5, rows: 7, square: 36.195, marker: 18.256, dictionary: DICT_6X6_250}\n"
        + NO_STANDARD
        + "observations: images\n"
    )
    return with_images(data / "rosi_charuco_static_camera", out / "rosi_charuco_static_camera", description)


def rendered_flat_board(data: Path, out: Path) -> Path:
    """Rendered images of a flat chessboard with marker dots, exact poses."""
    description = (
        HEADER.format(name="rendered_flat_board", angle="deg", mount="eye-in-hand")
        + "robot: {kinematics: none, label: rendered, positions: flange-poses, orientation: matrix,\n"
        "  direction: T_base_flange}\n"
        "head: {reference: camera, cameras: {camera: {image_size_px: [1920, 1080], intrinsics: calibrate}}}\n"
        "target: {kind: chessboard, columns: 14, rows: 9, square: 12.1}\n" + NO_STANDARD + "observations: images\n"
    )
    return with_images(data / "rendered_flat_board", out / "rendered_flat_board", description)


def with_images(source: Path, folder: Path, description: str) -> Path:
    """A recording of the poses whose images are there."""
    (folder / "images").mkdir(parents=True, exist_ok=True)
    rows = []
    for name, pose in matrices(source / "poses.csv"):
        image = source / "images" / (name if name.endswith(".png") else f"{name}.png")
        if image.is_file():
            shutil.copy2(image, folder / "images")
            rows.append([Path(name).stem, "board", "calibrate", *pose, f"images/{image.name}"])
    return write(folder, description, ["x", "y", "z", *MATRIX, "image_camera"], rows)


def fr3_joint_camera(data: Path, out: Path) -> Path:
    """Joint angles and measured board poses, no images."""
    source, folder = data / "fr3_joint_camera", out / "fr3_joint_camera"
    description = (
        HEADER.format(name="fr3_joint_camera", angle="rad", mount="eye-in-hand")
        + "robot: {name: franka_fr3, positions: joints}\nhead: {cameras: none}\ntarget: none\n"
        + NO_STANDARD
        + "observations: target-poses\ntarget_poses: {orientation: matrix, direction: T_target_head}\n"
    )
    with (source / "joints.csv").open(newline="") as file:
        joints = list(csv.reader(file))[1:]
    boards = [pose for _, pose in matrices(source / "board_T_cam.csv")]
    rows = [[str(i), "board", "calibrate", *q, *b] for i, (q, b) in enumerate(zip(joints, boards, strict=True))]
    columns = [f"q{j}" for j in range(1, 8)] + [f"target_{c}" for c in ["x", "y", "z", *MATRIX]]
    return write(folder, description, columns, rows)


def moveit_eye_to_hand_poses(data: Path, out: Path) -> Path:
    """Flange poses and measured target poses of a fixed camera."""
    source, folder = data / "moveit_eye_to_hand_poses", out / "moveit_eye_to_hand_poses"
    description = (
        HEADER.format(name="moveit_eye_to_hand_poses", angle="deg", mount="eye-to-hand")
        + "robot: {kinematics: none, label: unknown, positions: flange-poses, orientation: matrix,\n"
        "  direction: T_base_flange}\nhead: {cameras: none}\ntarget: none\n"
        + NO_STANDARD
        + "observations: target-poses\ntarget_poses: {orientation: matrix, direction: T_head_target}\n"
    )
    targets = [pose for _, pose in matrices(source / "cam_T_target.csv")]
    flanges = list(matrices(source / "poses.csv"))
    rows = [[name, "board", "calibrate", *f, *t] for (name, f), t in zip(flanges, targets, strict=True)]
    columns = ["x", "y", "z", *MATRIX, *(f"target_{c}" for c in ["x", "y", "z", *MATRIX])]
    return write(folder, description, columns, rows)


MUKCA = {"kuka_14": "kuka_lbr_iiwa14", "panda_1": "franka_panda", "panda_4_clean": "franka_panda"}
"""Robots of mukca_two_socket_50mm, and how sixthlink calls them."""


def mukca(data: Path, out: Path, robot: str, calibrate_at: str) -> Path:
    """Joint angles with a ball in one of two sockets 50 mm apart; one place calibrates, the others are read."""
    source = data / "mukca_two_socket_50mm" / robot
    name = f"mukca_{robot}_{calibrate_at}"
    description = (
        f"schema: sixthlink-recording/1\nname: {name}\nunits: {{length: mm, angle: rad}}\n"
        f"robot: {{name: {MUKCA[robot]}, positions: joints}}\n"
        "length_standard: {length: 50, uncertainty: 0.1, mark: socket, marks: [socket_0, socket_1]}\n"
        "observations: touches\n"
    )
    rows = []
    for path in sorted(source.glob("*/socket_?.csv")):
        place, socket = path.parent.name, path.stem
        with path.open(newline="") as file:
            joints = list(csv.reader(line for line in file if not line.startswith("#")))[1:]
        kind = "calibrate" if place == calibrate_at else "verify"
        rows += [[f"{place}_{socket}_{k:02d}", place, kind, socket, *q] for k, q in enumerate(joints)]
    return write(out / name, description, ["mark", *(f"q{j}" for j in range(1, 8))], rows)


def mukca_two_socket_50mm(data: Path, out: Path) -> Path:
    """The first of these: the KUKA, calibrated where it stands in front."""
    return mukca(data, out, "kuka_14", "front")


CONVERTERS = (denso_tabb_ds1, rosi_charuco_static_camera, fr3_joint_camera, moveit_eye_to_hand_poses)


def main() -> None:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    for convert in (*CONVERTERS, rendered_flat_board, mukca_two_socket_50mm):
        if (data / convert.__name__).is_dir():
            sys.stdout.write(f"{convert(data, out)}\n")


if __name__ == "__main__":
    main()
