"""What is simulated, and what comes out."""

from dataclasses import asdict, dataclass, fields
from typing import Any, Final

from hoz_dist.errors import InvalidValueError


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Machines, links and processes.

    Raises:
        InvalidValueError: A value is out of its range.
    """

    actors: int
    one_host: bool = False
    """All processes share one host, without a network; else the learner has a host, and each actor has a core of its
    own."""
    cores: int = 2
    """Cores of the learner's host, which are all there are with ``one_host``."""
    latency: float = 1e-4
    """Of a message, one way, seconds."""
    bandwidth: float = 1e10
    """Of an actor's link, each way, bits/s."""
    learner_bandwidth: float | None = None
    """Of the links of learners and relays, each way, bits/s; None for that of an actor."""
    max_lag: int = 32
    """``--max-lag``, versions: the largest policy lag at which a gradient is applied; rollouts may have about twice as
    much, see `RunConfig.most_lag`."""
    shards: int = 1
    """S, learners over which the parameters are split; each has a host."""
    fan_out: int | None = None
    """Largest number of processes that push to one. Where there are more, relays, each with a host, stand in between in
    as many levels as it takes; they hand parameters on and sum gradients up. None for no relays."""

    def __post_init__(self) -> None:
        """Check every field."""
        for name, low, high in _RANGES:
            value = getattr(self, name)
            if value is not None and not (low <= value <= high):
                message = f"'{name}' is {value:g}; it must be from {low:g} to {high:g}."
                raise InvalidValueError(message)
        if self.one_host and (self.shards > 1 or self.fan_out is not None):
            message = "Shards and relays have hosts of their own, so they cannot be simulated on one host."
            raise InvalidValueError(message)

    @property
    def relays(self) -> tuple[int, ...]:
        """Relays of each level, the one below the learner first."""
        levels: list[int] = []
        below = self.actors
        while self.fan_out is not None and below > self.fan_out:
            below = -(-below // self.fan_out)
            levels.insert(0, below)
        return tuple(levels)

    @property
    def hub_bandwidth(self) -> float:
        """Of the link of a learner or relay, each way, bits/s."""
        return self.bandwidth if self.learner_bandwidth is None else self.learner_bandwidth


_RANGES: Final = (
    ("actors", 1, 100_000),
    ("cores", 1, 4096),
    ("latency", 0.0, 10.0),
    ("bandwidth", 1e3, 1e15),
    ("learner_bandwidth", 1e3, 1e15),
    ("max_lag", 0, 100_000),
    ("shards", 1, 4096),
    ("fan_out", 2, 100_000),
)
"""Field, least value, largest value."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """What a run would do once it is under way. Loads are shares of the time, in [0, 1]."""

    actors: int
    gets_on: bool
    """False when in an hour nothing was answered for good: then the figures are of what was simulated until then."""
    frames_per_second: float
    """Of gradients that are applied."""
    updates_per_second: float
    """New versions of the parameters; with relays each is of many gradients."""
    lag: float
    """Policy lag of applied gradients, versions; mean."""
    lag_max: int
    age: float
    """Time from an actor's parameters to the gradient's application, seconds; mean."""
    stale: float
    """Share of gradients that are refused because of their lag."""
    busy: float
    """Times that the learner tells a push to come again."""
    resent: float
    """Times that a push to the learner is sent again because no answer came in time."""
    gil_wait: float
    """Share of the time in which the learner's threads have work that they wait for the interpreter lock."""
    actor_load: float
    """Of an actor, computing."""
    apply_load: float
    """Of the learner's own thread; what it waits for the interpreter lock does not count, as in the next two."""
    receive_load: float
    """Of the learner's thread that receives gradients."""
    serve_load: float
    """Of the learner's thread that serves parameters."""
    gil_load: float
    """Of the learner's interpreter lock."""
    host_load: float
    """Of the cores of the learner's host."""
    up_load: float
    """Of the learner's link, towards it."""
    down_load: float
    """Of the learner's link, from it."""
    relay_load: float | None
    """Of the busiest resource of a relay; None without relays."""
    megabits_up: float
    """That arrive at the learner, Mbit/s."""
    megabits_down: float
    """From the learner, Mbit/s."""
    simulated_seconds: float

    @property
    def bottleneck(self) -> str:
        """What is fullest; ``waiting`` when nothing is nearly full: then messages are under way most of the time."""
        name, load = max(((name, load) for name, load in self._loads().items()), key=lambda one: one[1])
        return name if load >= _FULL or not self.gets_on else "waiting"

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return asdict(self) | {"bottleneck": self.bottleneck}

    def _loads(self) -> dict[str, float]:
        loads = {field.name: getattr(self, field.name) for field in fields(self) if field.name.endswith("_load")}
        return {name.removesuffix("_load"): load for name, load in loads.items() if load is not None}


_FULL: Final = 0.8
"""Load from which something counts as nearly full."""
