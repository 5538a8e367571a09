"""What do the images of a recording show, in a terminal and as JSON?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from sixthlink.camera import LENS_NAMES, lens_vector
from sixthlink.workflow import ImageReport

__all__ = ["detection_as_dict", "detection_summary"]


def detection_as_dict(r: ImageReport) -> dict[str, Any]:
    """The JSON object of ``sixthlink detect``."""
    return {
        "recording": r.recording.name,
        "images": r.images,
        "found": r.images - len(r.rejections),
        "rejected": [
            {"image": _image(r, shot, camera), "shot": shot, "camera": camera, "reason": reason}
            for shot, camera, reason in ((x.shot, x.camera, x.reason) for x in r.rejections)
        ],
        "recalled": r.recalled,
        "points": len(r.detections),
        "decode_s": r.decode_s,
        "total_s": r.total_s,
        "cameras": list(_cameras(r)),
        "cameras_reason": r.why,
        "lens_models": [] if r.cameras is None else [asdict(m) for m in r.cameras.models],
        "board": None
        if r.cameras is None
        else {
            "sag_m": r.cameras.shape.sag_m if r.cameras.shape else 0.0,
            "sag_std_m": r.cameras.shape.sag_std_m if r.cameras.shape else None,
            "print_sigma_m": r.cameras.print_sigma_m,
        },
        "stereo": [asdict(check) for check in r.stereo],
        "notes": list(r.notes),
    }


def detection_summary(r: ImageReport, files: Mapping[str, str]) -> str:
    """Images, times, cameras and what was refused."""
    found = r.images - len(r.rejections)
    lines = [
        f"{r.recording.name}: {found} of {r.images} images show what they should, {len(r.detections)} points",
        f"{r.total_s:.2f} s in all, {r.decode_s:.2f} s of it for decoding"
        + (f"; {r.recalled} images were known from before" if r.recalled else ""),
    ]
    for camera in _cameras(r):
        line = f"camera {camera['name']:<10} {camera['found']} images, corners ± {camera['sigma_px']:.4f} px stated"
        if camera["rms_px"] is not None:
            line += f", {camera['rms_px']:.4f} px RMS residual"
        if camera["std"] is not None:
            fx, std = camera["lens"]["fx"], camera["std"]["fx"]
            line += f"; {camera['model']}, focal length {fx:.2f} ± {std:.2f} px ({100 * std / fx:.2f} %)"
        lines.append(line)
    if r.cameras is not None:
        lines += [
            f"lens model {m.model:<11}{'entered' if m.entered else 'left out'}: squared residuals of unseen views fall "
            f"by a factor of exp({m.gain:.3f} ± {m.standard_error:.3f})"
            for m in r.cameras.models
        ]
        if r.cameras.shape is not None:
            sag, std = r.cameras.shape.sag_m * 1e3, r.cameras.shape.sag_std_m * 1e3
            lines.append(f"the board is bent by {sag:.3f} ± {std:.3f} mm; corrected")
    if r.why:
        lines.append(f"cameras not calibrated from these images: {r.why}")
    lines += [f"stereo {check.words}" for check in r.stereo]
    lines += [f"note      {note}" for note in r.notes]
    lines += [f"rejected  {_image(r, x.shot, x.camera)}: {x.reason}" for x in r.rejections]
    return "\n".join([*lines, *(f"wrote {path}" for path in files.values())])


def _image(r: ImageReport, shot: str, camera: str) -> str:
    """File name of an image."""
    names = r.recording.images.get(camera, ())
    return names[r.recording.ids.index(shot)] if names else shot


def _cameras(r: ImageReport) -> Iterator[dict[str, Any]]:
    """What the images say of each camera."""
    for c, description in enumerate(r.recording.head.cameras):
        rows = r.detections.cameras == c
        evidence = r.cameras.cameras[c] if r.cameras is not None else None
        lens = r.cameras.rig.cameras[c] if r.cameras is not None else description.camera
        calibrated = evidence is not None and evidence.calibrated
        yield {
            "name": description.name,
            "found": len(np.unique(r.detections.shots[rows])),
            "points": int(rows.sum()),
            "sigma_px": float(np.sqrt(np.mean(r.detections.sigmas_px[rows] ** 2))) if rows.any() else 0.0,
            "rms_px": None if evidence is None else evidence.rms_px,
            "calibrated": calibrated,
            "model": None if lens is None else lens.model,
            "lens": None if lens is None else dict(zip(LENS_NAMES, lens_vector(lens).tolist(), strict=True)),
            "std": dict(zip(LENS_NAMES, evidence.std.tolist(), strict=True)) if evidence and calibrated else None,
        }
