"""Monte Carlo over simulated recordings: do the intervals hold, and could anybody do better?"""

from sixthlink.study.design import CONTROLS, NOISES, SOURCES, Study, grid
from sixthlink.study.plan import Plan, planned
from sixthlink.study.summary import Mean, PointSummary, Quantity, Verdict, summaries
from sixthlink.study.trial import CHI2, FAILED, Row, run_trial

__all__ = [
    "CHI2",
    "CONTROLS",
    "FAILED",
    "NOISES",
    "SOURCES",
    "Mean",
    "Plan",
    "PointSummary",
    "Quantity",
    "Row",
    "Study",
    "Verdict",
    "grid",
    "planned",
    "run_trial",
    "summaries",
]
