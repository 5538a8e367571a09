"""What must an arm from a tracker record answer with yes before it is accepted?"""

from __future__ import annotations

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.tracked_arm.tracked_arm import TrackedArm
from sixthlink.units import MM

__all__ = ["record_gates"]

MINIMUM_USED_SHARE = 0.9
"""Share of the points that must belong: the few outliers of an instrument, not a second truth."""

LARGEST_HELDOUT_RATIO = 3.0


def record_gates(result: TrackedArm, points: int) -> tuple[Gate, ...]:
    """The gates of an arm from so many points."""
    sweeps = [f for f in result.findings if f.finding.grave and f.where != "record"]
    record = [f for f in result.findings if f.finding.grave and f.where == "record"]
    unchecked = [f.finding.words for f in result.findings if f.finding.kind == "drift not checked"]
    unseen = [r for r in result.reflectors if r.unseen]
    share = len(result.used) / max(points, 1)
    ratio = result.heldout.rms_m / max(result.train.rms_m, 1e-9)
    swept = f"{len(result.sweeps)} sweeps, all usable" if result.sweeps else "no sweeps: the points alone speak"
    return (
        Gate(
            "sweeps are circles",
            not sweeps,
            "; ".join(f"{f.where}: {f.finding}" for f in sweeps) if sweeps else swept,
        ),
        Gate(
            "tracker stood still",
            not record,
            "; ".join(str(f.finding) for f in record)
            if record
            else (unchecked[0] if unchecked else "the reference points stayed where they were"),
        ),
        Gate(
            "enough points used",
            share >= MINIMUM_USED_SHARE,
            f"{len(result.used)} of {points} points belong, at least {MINIMUM_USED_SHARE:.0%} are needed"
            + ("" if share >= MINIMUM_USED_SHARE else "; the rejections say which do not and by how much"),
        ),
        Gate(
            "unseen points agree",
            ratio <= LARGEST_HELDOUT_RATIO,
            f"points that a fit has not seen are off by {result.heldout.rms_m / MM:.3g} mm RMS, {ratio:.2f} times as "
            f"much as those that it has, at most {LARGEST_HELDOUT_RATIO:g} times is accepted"
            + ("" if ratio <= LARGEST_HELDOUT_RATIO else "; measure more points, all over the joint ranges"),
        ),
        Gate(
            "reflectors are seen",
            not unseen,
            "; ".join(f"{r.name}: where it sits on link {r.link} is not seen {r.unseen}" for r in unseen)
            + "; measure poses in which other joints move as well"
            if unseen
            else "where every reflector sits is determined by the points",
        ),
    )
