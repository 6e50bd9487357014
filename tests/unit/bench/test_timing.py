from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial

from hoz_dist.bench.timing import Contender, rate, run_contests, seconds_per_call


class Clock:
    """A clock that goes on only when told to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now

    def takes(self, seconds: float) -> Callable[..., float]:
        def work(*_: object) -> float:
            self.now += seconds
            return seconds

        return work


def test_contenders_take_turns_and_the_first_round_warms_up() -> None:
    turns: list[str] = []
    open_contests: list[str] = []

    @contextmanager
    def contest(*names: str) -> Iterator[Mapping[str, Contender]]:
        def measure(name: str) -> float:
            assert open_contests == list(names)
            turns.append(name)
            return float(len(turns))

        open_contests.extend(names)
        yield {name: partial(measure, name) for name in names}
        open_contests.clear()

    told: list[tuple[float, float, str]] = []
    samples = run_contests(
        [lambda: contest("a", "b"), lambda: contest("c")], 2, lambda done, total, note: told.append((done, total, note))
    )

    assert turns == ["b", "a", "a", "b", "b", "a", "c", "c", "c"]
    assert samples == {"a": [3.0, 6.0], "b": [4.0, 5.0], "c": [8.0, 9.0]}
    assert told[0] == (0, 2, "b")
    assert told[6] == (1, 2, "c")
    assert told[-1] == (2, 2, "")
    assert [done for done, _, _ in told] == sorted(done for done, _, _ in told)


def test_a_rate_counts_whole_calls() -> None:
    clock = Clock()
    assert rate(clock.takes(0.25), 1.0, clock) == 4.0
    assert rate(clock.takes(5.0), 1.0, clock) == 0.2


def test_what_is_prepared_for_a_call_is_not_measured() -> None:
    clock = Clock()
    received: list[float] = []

    def work(material: float) -> None:
        received.append(material)
        clock.now += 0.5

    assert seconds_per_call(clock.takes(7.0), work, 1.0, clock) == 0.5
    assert received == [7.0, 7.0]
