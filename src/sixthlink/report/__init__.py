"""A calibration as one self-contained HTML page. Opens no user's file: everything comes in as arguments."""

from sixthlink.report.page import report_page
from sixthlink.report.touch_page import touch_page
from sixthlink.report.tracked_page import tracked_page

__all__ = ["report_page", "touch_page", "tracked_page"]
