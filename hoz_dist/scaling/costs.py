"""What one update costs, as measured, and how costs are kept in files."""

import json
from collections.abc import Iterable
from dataclasses import MISSING, asdict, dataclass, fields, replace
from importlib.resources import files
from typing import Final

from hoz_dist.errors import DamagedFileError, InvalidValueError, UnknownNameError

SHIPPED: Final = ("compact", "paper")
"""Presets whose costs come with the package."""
BYTES_OF_ENTRY: Final = {"fp32": 4.0, "bf16": 2.0, "int8": 1.0, "topk": 0.08}
"""Bytes of a parameter's gradient on the wire; ``topk`` sends 1% of them, each with its place."""
BYTES_OF_PARAMETER: Final = {"full": 4.0, "delta": 1.0}
"""Bytes of a parameter on the wire."""
BYTES_OF_FRAME: Final = 64.0
"""Bytes of a frame of a rollout on the wire."""


@dataclass(frozen=True, kw_only=True)
class Costs:
    """CPU seconds of the stages of one update, in one thread, and what travels.

    Raises:
        InvalidValueError: A number is negative or not finite, or a size is not positive.
    """

    # --- of what ---
    preset: str
    machine: str
    command: str
    """What measured them."""
    learn_from: str = "gradients"
    compress: str = "fp32"
    parameters_form: str = "full"
    parameters: int
    """P, numbers of the policy."""
    frames: float
    """Environment frames of one update."""
    # --- the actor ---
    act: float
    """Observe, decide and step through a rollout."""
    differentiate: float
    """Compute the gradient."""
    load: float
    """Put fetched parameters into the policy, and everything else."""
    push: float
    """Encode what is pushed."""
    fetch: float
    """Decode fetched parameters."""
    actor_wire: float
    """Zenoh's own threads."""
    # --- the learner ---
    receive: float
    """Check and decode what is pushed."""
    apply: float
    """Judge a gradient and change the parameters."""
    publish: float
    """Copy the parameters for readers and make them known."""
    serve: float
    """Encode the parameters for one reader."""
    record: float
    """Write records and checkpoints, and everything else."""
    learner_wire: float
    """Zenoh's own threads, as a router."""
    notify: float = 2e-6
    """Tell one actor that there are new parameters, in the learner's own thread."""
    notify_wire: float = 1e-5
    """The same in Zenoh's threads."""
    fixed: float = 2e-4
    """The part of ``receive``, ``apply``, ``publish`` and ``serve`` that fewer parameters would cost as well, each."""
    gil: float = 0.2
    """Share of the time of the learner's Python threads in which they hold the interpreter lock."""
    # --- the wire ---
    round_trips: int = 1
    """Questions and answers that follow each other when parameters are fetched."""
    exchange: float = 0.0
    """Time that a question and its answer take beside all that computes, seconds; fitted to a run of one actor."""
    crowding: float = 0.0
    """Share by which all takes longer while all cores of a host work; fitted to a run of two actors."""

    def __post_init__(self) -> None:
        """Check every field."""
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, str):
                continue
            low = 1 if field.name in _POSITIVE else 0
            if not low <= value < _MOST:
                message = f"'{field.name}' of the costs is {value:g}; it must be at least {low} and finite."
                raise InvalidValueError(message)
        _check("source to learn from", self.learn_from, ("gradients", "rollouts"))
        _check("compression", self.compress, BYTES_OF_ENTRY)
        _check("form of parameters", self.parameters_form, BYTES_OF_PARAMETER)

    @property
    def bytes_up(self) -> float:
        """Bytes of a push."""
        if self.learn_from == "rollouts":
            return BYTES_OF_FRAME * self.frames
        return BYTES_OF_ENTRY[self.compress] * self.parameters

    @property
    def bytes_down(self) -> float:
        """Bytes of all parameters."""
        return BYTES_OF_PARAMETER[self.parameters_form] * self.parameters

    def adapted(
        self, *, learn_from: str | None = None, compress: str | None = None, parameters_form: str | None = None
    ) -> "Costs":
        """Return the costs with something else on the wire; None leaves a choice as it was measured.

        Zenoh's time goes with the bytes. Coding is taken to cost what it did. A learner that learns from rollouts
        computes the gradients itself, and receives in proportion to the bytes.

        Raises:
            InvalidValueError: The costs are of rollouts, from which those of gradients cannot be told.
            UnknownNameError: There is no such choice.
        """
        new = replace(
            self,
            learn_from=learn_from or self.learn_from,
            compress=compress or self.compress,
            parameters_form=parameters_form or self.parameters_form,
        )
        share = (new.bytes_up + new.bytes_down) / (self.bytes_up + self.bytes_down)
        new = replace(new, actor_wire=share * self.actor_wire, learner_wire=share * self.learner_wire)
        if new.learn_from == self.learn_from:
            return new
        if self.learn_from == "rollouts":
            message = "These costs are of rollouts; those of gradients need a measurement of their own."
            raise InvalidValueError(message)
        up = new.bytes_up / self.bytes_up
        return replace(
            new,
            differentiate=0.0,
            apply=self.apply + self.differentiate,
            receive=self.fixed + up * self.receive,
            push=up * self.push,
        )

    def part(self, shards: int) -> "Costs":
        """Return what one of several learners has to do, which share the parameters between them."""

        def share(seconds: float) -> float:
            fixed = min(self.fixed, seconds)
            return fixed + (seconds - fixed) / shards

        return replace(
            self,
            parameters=-(-self.parameters // shards),
            receive=share(self.receive),
            apply=share(self.apply),
            publish=share(self.publish),
            serve=share(self.serve),
            learner_wire=self.learner_wire / shards,
            round_trips=-(-self.round_trips // shards),
        )

    def to_text(self) -> str:
        """Return the content of a file of costs, JSON."""
        return json.dumps(asdict(self), indent=2) + "\n"

    @classmethod
    def from_text(cls, text: str, path: str) -> "Costs":
        """Read the content of a file of costs.

        Args:
            text: JSON.
            path: Where it is from, for messages.

        Raises:
            DamagedFileError: It is not JSON, a field is missing, unknown or of the wrong type, or a value is.
        """
        try:
            values = json.loads(text)
        except ValueError as error:
            message = f"'{path}' is no file of costs: it is not JSON ({error})."
            raise DamagedFileError(message) from error
        known = {field.name: field for field in fields(cls)}
        needed = {name for name, field in known.items() if field.default is MISSING}
        given = set(values) if isinstance(values, dict) else set()
        if wrong := sorted((needed - given) | (given - set(known))) or not given:
            what = ", ".join(wrong) if isinstance(wrong, list) else "all"
            message = f"'{path}' is no file of costs of this version of hoz-dist; missing or unknown: {what}."
            raise DamagedFileError(message)
        for name, value in values.items():
            if not _fits(value, known[name].type):
                message = f"'{path}' is no file of costs: '{name}' is {value!r}, which is of the wrong type."
                raise DamagedFileError(message)
        try:
            return cls(**values)
        except (InvalidValueError, UnknownNameError) as error:
            message = f"'{path}' is no file of costs: {error}"
            raise DamagedFileError(message) from error


def shipped_costs(preset: str) -> Costs:
    """Return the costs that come with the package.

    Raises:
        UnknownNameError: There are none of that preset.
    """
    _check("preset", preset, SHIPPED)
    file = files("hoz_dist.scaling") / "measured" / f"{preset}.json"
    return Costs.from_text(file.read_text(encoding="utf-8"), str(file))


_POSITIVE: Final = frozenset({"parameters", "frames", "round_trips"})
_MOST: Final = 1e12


def _check(what: str, name: str, known: Iterable[str]) -> None:
    names = tuple(known)
    if name not in names:
        raise UnknownNameError.of(what, name, names)


def _fits(value: object, type_: object) -> bool:
    """Tell whether a JSON value is of a field's type."""
    if type_ is float:
        return type(value) in {int, float}
    return type(value) is type_
