"""The head: eq. (10)-(11) as a problem, its factor, its proven minimum, the paper's search and the polish."""

from sixthlink.calibrate.head.certificate import GAP_TOLERANCE, Certificate, certificate_of, solve_certified
from sixthlink.calibrate.head.compare import SolverScore, compare_solvers
from sixthlink.calibrate.head.factor import (
    PAPER_ROTATION_LENGTH_M,
    FactorStream,
    Objective,
    best_translation,
    objective,
    objective_values,
    rotation_values,
)
from sixthlink.calibrate.head.held import Held, held_objective, held_turns
from sixthlink.calibrate.head.observability import Observability, observability
from sixthlink.calibrate.head.problem import (
    HeadProblem,
    Scatter,
    head_problem,
    placement_poses,
    scatter,
)
from sixthlink.calibrate.head.refine import polished
from sixthlink.calibrate.head.search import SearchBox, SearchReport, search_box, search_head

__all__ = [
    "GAP_TOLERANCE",
    "PAPER_ROTATION_LENGTH_M",
    "Certificate",
    "FactorStream",
    "HeadProblem",
    "Held",
    "Objective",
    "Observability",
    "Scatter",
    "SearchBox",
    "SearchReport",
    "SolverScore",
    "best_translation",
    "certificate_of",
    "compare_solvers",
    "head_problem",
    "held_objective",
    "held_turns",
    "objective",
    "objective_values",
    "observability",
    "placement_poses",
    "polished",
    "rotation_values",
    "scatter",
    "search_box",
    "search_head",
    "solve_certified",
]
