import importlib.metadata
import re

import pytest

from hoz_dist.cli.checks import machine
from hoz_dist.cli.checks.finding import Finding


def test_a_finding_reads_as_a_sentence() -> None:
    assert Finding("cores", "ok", "2").sentence == "cores: 2."
    assert Finding("cores", "warn", "1", "Use two.").sentence == "cores: 1. Use two."


def test_this_machine_can_run_hoz_dist() -> None:
    findings = [
        machine.check_python(),
        *machine.check_packages(),
        machine.check_cores(),
        machine.check_memory(),
        machine.check_shared_memory(),
    ]
    assert not [finding for finding in findings if finding.state == "fail"]


@pytest.mark.parametrize(
    ("requirement", "found"),
    [("nosuchpackage>=1.0", "nosuchpackage is missing"), ("click>=999.0", "click .* is too old")],
)
def test_packages_that_are_missing_or_too_old_fail(
    requirement: str, found: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda _: [requirement, 'ruff>=99; extra == "dev"'])
    (finding,) = machine.check_packages()
    assert finding.state == "fail"
    assert re.fullmatch(found, finding.found)


@pytest.mark.parametrize(
    ("version", "least", "enough"),
    [("2.13.0+cpu", "2.6", True), ("2.10", "2.9", True), ("1.10.2", "1.10.2", True), ("1.9.9", "1.10", False)],
)
def test_versions_compare_by_number(version: str, least: str, enough: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda _: [f"click>={least}"])
    monkeypatch.setattr(importlib.metadata, "version", lambda _: version)
    (finding,) = machine.check_packages()
    assert (finding.state == "ok") == enough
