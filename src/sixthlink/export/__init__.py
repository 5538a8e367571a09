"""What leaves the program for other machines: targets for the printer."""

from sixthlink.export.target_pdf import PAPERS_MM, Page, page_for, target_pdf

__all__ = ["PAPERS_MM", "Page", "page_for", "target_pdf"]
