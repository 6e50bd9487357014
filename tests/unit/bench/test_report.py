import json
import platform

import pytest

from hoz_dist.bench.report import Metric, Report, this_machine


def test_a_metric_sums_up_measurements_and_those_of_its_limit() -> None:
    assert Metric.of([3.0, 1.0, 9.0], "ms", [2.0, 1.0, 4.0]) == Metric(3.0, 1.0, 9.0, "ms", 2.0)
    assert Metric.of([3.0], "ms", 1.5).limit == 1.5
    assert Metric.of([3.0], "bytes").limit is None


def test_a_report_is_exactly_this_json() -> None:
    report = Report({"push_ms": Metric.of([2.0, 1.0], "ms")}, {"cores": 2}, "hoz-dist bench wire")
    assert json.loads(json.dumps(report.to_json())) == {
        "metrics": {"push_ms": {"median": 1.5, "min": 1.0, "max": 2.0, "unit": "ms", "limit": None}},
        "machine": {"cores": 2},
        "command": "hoz-dist bench wire",
    }


@pytest.mark.parametrize("fact", ["cpu", "cores", "memory_gib", "kernel", "python", "torch", "zenoh"])
def test_the_machine_is_described_but_not_named(fact: str) -> None:
    machine = this_machine()
    assert machine[fact]
    text = json.dumps(machine)
    assert platform.node() not in text
    assert "/root" not in text
    assert "/home" not in text
