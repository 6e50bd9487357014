"""Prints the figures of the campaigns at the end of a test run."""

import pytest

from tests.campaigns import report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if report.kept():
        terminalreporter.section("figures of the campaigns")
        for line in report.kept():
            terminalreporter.write_line(line)
