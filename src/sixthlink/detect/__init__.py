"""Which images show the target or a mark, and at which pixels? A walk over the recorded shots."""

from sixthlink.detect.detect import Memory, detect

__all__ = ["Memory", "detect"]
