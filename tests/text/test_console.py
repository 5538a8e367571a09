"""What a terminal shows when something is wrong."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from sixthlink.cli.console import SHOWN_FINDINGS, fail
from sixthlink.cli.main import main
from sixthlink.errors import CalibrationError, Finding, InputError


def findings(count: int) -> InputError:
    return InputError([Finding("shots.csv", "q1", "is 'x'", "a number", "write one", k + 2, 4) for k in range(count)])


def test_a_finding_reads_as_place_field_what_expected_and_cure(capsys):
    with pytest.raises(SystemExit) as stop:
        fail(findings(1), as_json=False)
    assert stop.value.code == 2
    assert capsys.readouterr().err == (
        "shots.csv:2:4: q1: is 'x', expected a number; write one\n1 finding; nothing was written.\n"
    )


def test_thousands_of_findings_are_cut_and_counted(capsys):
    with pytest.raises(SystemExit):
        fail(findings(5000), as_json=False)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == SHOWN_FINDINGS + 1
    assert lines[-1] == f"5000 findings, the first {SHOWN_FINDINGS} shown, all with --json; nothing was written."


@pytest.mark.parametrize(("problem", "code"), [(CalibrationError("too flat"), 2), (ZeroDivisionError("ours"), 3)])
def test_exit_codes_tell_the_users_fault_from_ours(problem, code, capsys):
    with pytest.raises(SystemExit) as stop:
        fail(problem, as_json=False)
    assert stop.value.code == code
    assert str(problem) in capsys.readouterr().err


def test_the_help_shows_its_examples_one_to_a_line():
    text = CliRunner().invoke(main, ["--help"]).output
    assert "\\b" not in text
    assert "  sixthlink verify cell" in text.replace("    ", "  ")
    assert len([line for line in text.splitlines() if line.strip().startswith("sixthlink ")]) == 5
