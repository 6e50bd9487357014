import pytest

from hoz_dist.wire.transport.environment import child_environment


def test_children_get_the_settings_and_all_that_the_user_has_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ZENOH_RUNTIME", raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.setenv("HOZ_SOMETHING", "kept")
    environment = child_environment()
    assert environment["ZENOH_RUNTIME"] == "(rx: (worker_threads: 8))"
    assert environment["OMP_NUM_THREADS"] == "3"
    assert environment["HOZ_SOMETHING"] == "kept"
