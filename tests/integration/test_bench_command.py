"""`hoz-dist bench`, with sizes so tiny that its figures say nothing: what is printed, and that it works."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.bench.bare import answer_bare
from hoz_dist.bench.query import bench_query, graph_bytes
from hoz_dist.bench.receiver import receive
from hoz_dist.bench.render import bench_render
from hoz_dist.bench.wire import bench_wire
from hoz_dist.cli.main import run
from hoz_dist.cli.ports import free_endpoint
from hoz_dist.nav.rooms import RoomId
from tests import wire_samples as samples
from tests.integration.commands import SMALL_ROOMS

pytestmark = pytest.mark.integration
MOMENT_S = 0.0001


def silent(*_: object) -> None:
    pass


@contextmanager
def serving(serve: Callable[..., None], *arguments: Any, **keywords: Any) -> Iterator[None]:
    """Let a function that a companion would run serve in a thread."""
    ready, stop = threading.Event(), threading.Event()
    keywords |= {"ready": ready.set, "stopped": stop.wait}
    thread = threading.Thread(target=serve, args=arguments, kwargs=keywords)
    thread.start()
    try:
        assert ready.wait(10.0)
        yield
    finally:
        stop.set()
        thread.join()


def test_env_prints_json_with_the_promised_figures(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--scene", SMALL_ROOMS[0], "--picture-size", "16", "--cache", str(cache), "--batch", "8"]
    assert run(["bench", "env", *options, "--seconds", "0.001", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)

    assert set(report) == {"metrics", "machine", "command"}
    assert set(report["metrics"]) == {"env_steps_per_second", "env_steps_per_second_b64", "room_open_ms"}
    for metric in report["metrics"].values():
        assert set(metric) == {"median", "min", "max", "unit", "limit"}
        assert 0 < metric["min"] <= metric["median"] <= metric["max"]
        assert metric["limit"] > 0
    assert report["command"] == (
        f"hoz-dist bench env --batch 8 --scene {SMALL_ROOMS[0]} --picture-size 16 --cache PATH --seconds 0.001"
    )
    assert str(cache) not in json.dumps(report)


def test_render_draws_both_sizes() -> None:
    metrics = bench_render(RoomId.parse(SMALL_ROOMS[0]), (16, 24), seconds=MOMENT_S, repeats=1, progress=silent)
    assert set(metrics) == {"render_views_per_second_16", "render_views_per_second_24"}
    assert all(metric.limit for metric in metrics.values())


def test_wire_pushes_and_fetches() -> None:
    plain, shared = free_endpoint(), free_endpoint()
    with (
        serving(receive, plain, 50_000, shared_memory=False),
        serving(receive, shared, 50_000, shared_memory=True),
    ):
        metrics = bench_wire(plain, shared, 50_000, ("fp32", "topk"), seconds=MOMENT_S, repeats=1, progress=silent)
    limited = {f"wire_{what}{how}_ms" for what in ("push", "fetch", "fetch_delta") for how in ("", "_shared_memory")}
    limited.add("wire_small_push_ms")
    assert {name for name, metric in metrics.items() if metric.limit} == limited
    assert set(metrics) - limited == {"wire_gradient_bytes_fp32", "wire_gradient_bytes_topk"}
    assert metrics["wire_gradient_bytes_topk"].median * 30 < metrics["wire_gradient_bytes_fp32"].median


def test_query_asks_alone_and_with_others() -> None:
    endpoint, bare = free_endpoint(), free_endpoint()
    with samples.serving(endpoint) as (server, _):
        server.put_graph(samples.scene_graph())
        payload = graph_bytes("kitchen", endpoint)
        with serving(answer_bare, bare, payload):
            metrics = bench_query(
                endpoint, bare, "kitchen", "idle", clients=2, seconds=MOMENT_S, repeats=1, progress=silent
            )
    names = ("p50_ms", "p99_ms", "several_p99_ms", "per_second")
    assert set(metrics) == {f"query_idle_{name}" for name in names}
    assert all(metric.limit for metric in metrics.values())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["env", "--repeats", "2"], "Invalid value for '--repeats'"),
        (["env", "--scene", "garage"], "Unknown scene 'garage'"),
        (["env", "--scene", "kitchen/25"], "Room kitchen/25 is kept for"),
        (["render", "--room", "kitchen/99"], "Unknown room 'kitchen/99'"),
        (["policy", "--preset", "huge"], "Invalid value for '--preset'"),
        (["learner", "--compress", "zip"], "Invalid value for '--compress'"),
        (["query", "--connect", "nowhere"], "'nowhere' is not an endpoint"),
        (["query", "--connect", "tcp/127.0.0.1:1", "--training", "--actors", "2"], "--actors and --cache are of a"),
        (["query", "--cache", "views"], "--actors and --cache are of a training that is started here"),
        (["train", "--costs", "costs.json"], "--costs needs runs with 1 and 2 actors"),
    ],
)
def test_bad_input_is_one_sentence(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", *words]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert error.startswith(f"hoz-dist: {said}")
    assert error.count("\n") == 1
