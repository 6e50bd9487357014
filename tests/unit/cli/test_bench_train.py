"""The loops that `hoz-dist bench train` measures beside whole runs."""

import os
from functools import partial
from pathlib import Path

from hoz_dist.cli.apart import companion
from hoz_dist.cli.bench_train import _Loops
from tests.unit.cli.test_apart import is_noted, note_cores
from tests.waiting import until


def test_loops_share_a_core_only_as_long_as_that_is_measured(tmp_path: Path) -> None:
    mine, path = os.sched_getaffinity(0), tmp_path / "cores"
    with companion(partial(note_cores, path)) as served:
        loops = _Loops([], [served])
        bound = loops.first(1, max(mine))
        bound.resume()
        until(partial(is_noted, path, [{max(mine)}] * 2), "the core")
        bound.pause()
        loops.resume()
        until(partial(is_noted, path, [mine] * 2), "all cores")
