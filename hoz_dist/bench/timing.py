"""Measuring: what is to be compared takes turns, so that a machine that slows down slows down all of it."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Final, TypeVar

LEAST_REPEATS: Final = 5
"""A median of fewer says little on a shared machine."""
Contender = Callable[[], float]
"""Measures once, and returns the figure."""
Contest = Callable[[], AbstractContextManager[Mapping[str, Contender]]]
"""Gets contenders ready, by name, and cleans up after them."""
Samples = Mapping[str, Sequence[float]]
"""The figures of each contender, by its name."""
Progress = Callable[[float, float, str], None]
"""Called with how many contests are done, how many there are, and what is measured now."""
Clock = Callable[[], float]
"""Tells a time in seconds."""
core_seconds: Final[Clock] = time.process_time
"""The time in which this process really ran on a core: it stands still while another process has the core."""
T = TypeVar("T")


def run_contests(contests: Sequence[Contest], repeats: int, progress: Progress) -> Samples:
    """Run contests one after the other; the names of all contenders differ.

    Args:
        contests: The contests.
        repeats: Figures wanted of each contender.
        progress: Told how far the work is.
    """
    samples: dict[str, Sequence[float]] = {}
    for number, contest in enumerate(contests):
        with contest() as contenders:
            for share, name in _turns(contenders, repeats, samples):
                progress(number + share, len(contests), name)
    progress(len(contests), len(contests), "")
    return samples


def _turns(
    contenders: Mapping[str, Contender], repeats: int, samples: dict[str, Sequence[float]]
) -> Iterator[tuple[float, str]]:
    """Let contenders take turns, each round in the opposite order; yields the share that is done and who is next."""
    own: dict[str, list[float]] = {name: [] for name in contenders}
    samples |= own
    turns = (repeats + 1) * len(contenders)
    done = 0
    for repeat in range(repeats + 1):
        order = list(contenders)[:: 1 if repeat % 2 else -1]
        for name in order:
            yield done / turns, name
            figure = contenders[name]()
            done += 1
            if repeat > 0:  # the first round warms up
                own[name].append(figure)


def rate(work: Callable[[], object], seconds: float, clock: Clock = time.perf_counter) -> float:
    """Return how often per second some work can be done.

    Args:
        work: The work.
        seconds: It is repeated for so long, and done at least once.
        clock: Seconds of what; `core_seconds` for work that waits for nobody.
    """
    count, start = 0, clock()
    while True:
        work()
        count += 1
        elapsed = clock() - start
        if elapsed >= seconds:
            return count / elapsed


def seconds_per_call(
    prepare: Callable[[], T], work: Callable[[T], object], seconds: float, clock: Clock = time.perf_counter
) -> float:
    """Return how long some work takes, without what has to be prepared for it each time.

    Args:
        prepare: Makes what the work needs.
        work: The work.
        seconds: It is repeated until it has taken so long, and done at least once.
        clock: Seconds of what; see `rate`.
    """
    count, elapsed = 0, 0.0
    while not count or elapsed < seconds:
        material = prepare()
        start = clock()
        work(material)
        elapsed += clock() - start
        count += 1
    return elapsed / count
