"""What one update costs, as measured, and how costs are kept in files."""

import json
from collections.abc import Iterable
from dataclasses import MISSING, asdict, dataclass, fields, replace
from functools import cached_property
from importlib.resources import files
from typing import Final

from hoz_dist.errors import DamagedFileError, InvalidValueError, UnknownNameError
from hoz_dist.scaling.sizes import (
    COMPRESSIONS,
    PARAMETERS_FORMS,
    gradient_bytes,
    parameters_bytes,
    questions,
    rollout_bytes,
)

SHIPPED: Final = ("compact", "paper")
"""Presets whose costs come with the package."""
SOURCES: Final = ("gradients", "rollouts")
"""What a run can learn from."""


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
    """Compute the gradient; 0 with rollouts."""
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
    """Judge a gradient and change the parameters; of a rollout, compute its gradient too."""
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
    fixed: float = 4e-4
    """The part of ``receive``, ``apply``, ``publish`` and ``serve`` that fewer parameters would cost as well, each; in
    the interpreter, whose lock it holds."""
    gil: float = 0.2
    """Share of the rest of the time of the learner's Python threads in which they hold the interpreter lock: not
    measured; NumPy and PyTorch give it up for most of what they do."""
    # --- the host ---
    switching: float
    """Share by which all takes longer while more threads than cores of a host have work, so that processes take turns:
    measured with two of them on one core; 0 if it could not be."""
    # --- fitted to two runs on one host; see `hoz_dist.scaling.calibration` ---
    exchange: float = 0.0
    """Time that a question and its answer take beside all that computes, seconds."""
    crowding: float = 0.0
    """Share by which all takes longer while all cores of a host work, whether or not processes take turns."""
    measured_one: float = 0.0
    """Frames per second of the run with one actor; 0 if nothing was fitted, as the next three."""
    measured_two: float = 0.0
    """With two."""
    modelled_one: float = 0.0
    """What the model makes of it."""
    modelled_two: float = 0.0

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
        if self.gil > 1.0:
            message = f"'gil' of the costs is {self.gil:g}; it is a share, and at most 1."
            raise InvalidValueError(message)
        _check("source to learn from", self.learn_from, SOURCES)
        _check("compression", self.compress, COMPRESSIONS)
        _check("form of parameters", self.parameters_form, PARAMETERS_FORMS)

    @cached_property
    def bytes_up(self) -> float:
        """Bytes of a push."""
        if self.learn_from == "rollouts":
            return rollout_bytes(self.frames)
        return gradient_bytes(self.compress, self.parameters)

    @cached_property
    def bytes_down(self) -> float:
        """Bytes of all parameters."""
        return parameters_bytes(self.parameters_form, self.parameters)

    @cached_property
    def questions(self) -> int:
        """Questions in which all parameters are fetched."""
        return questions(self.parameters_form, self.parameters)

    @cached_property
    def up_share(self) -> float:
        """Share of an update's bytes, and so of Zenoh's time, that goes to the push; the rest goes to parameters."""
        return self.bytes_up / (self.bytes_up + self.bytes_down)

    def held(self, seconds: float) -> float:
        """Return for how long a stage of a learner's Python thread holds the interpreter lock."""
        fixed = min(self.fixed, seconds)
        return fixed + self.gil * (seconds - fixed)

    def adapted(
        self, *, learn_from: str | None = None, compress: str | None = None, parameters_form: str | None = None
    ) -> "Costs":
        """Return the costs with something else on the wire; None leaves a choice as it was measured.

        Zenoh's time goes with the bytes. Coding is taken to cost what it did. What a learner does with a rollout is
        estimated if it was not measured: it goes through the steps once more and differentiates, which is taken to cost
        what acting and differentiating cost the actor, and receives in proportion to the bytes.

        Raises:
            InvalidValueError: The costs are of rollouts, from which those of gradients cannot be told; or there would
                be a compression of rollouts.
            UnknownNameError: There is no such choice.
        """
        learn_from = learn_from or self.learn_from
        if learn_from == "rollouts":
            if compress not in {None, "fp32"}:
                message = "Only gradients are compressed: leave out the compression, or learn from gradients."
                raise InvalidValueError(message)
            compress = "fp32"
        elif self.learn_from == "rollouts":
            message = "These costs are of rollouts; those of gradients need a measurement of their own."
            raise InvalidValueError(message)
        new = replace(
            self,
            learn_from=learn_from,
            compress=compress or self.compress,
            parameters_form=parameters_form or self.parameters_form,
        )
        share = (new.bytes_up + new.bytes_down) / (self.bytes_up + self.bytes_down)
        new = replace(new, actor_wire=share * self.actor_wire, learner_wire=share * self.learner_wire)
        if new.learn_from == self.learn_from:
            return new
        up = new.bytes_up / self.bytes_up
        return replace(
            new,
            differentiate=0.0,
            apply=self.apply + self.act + self.differentiate,
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


def shipped_costs(preset: str) -> list[Costs]:
    """Return the costs that come with the package: of gradients, and of rollouts if they were measured.

    Raises:
        UnknownNameError: There are none of that preset.
    """
    _check("preset", preset, SHIPPED)
    folder = files("hoz_dist.scaling") / "measured"
    there = [file for name in (preset, f"{preset}-rollouts") if (file := folder / f"{name}.json").is_file()]
    return [Costs.from_text(file.read_text(encoding="utf-8"), str(file)) for file in there]


def costs_of(measured: Iterable[Costs], learn_from: str | None = None) -> Costs:
    """Return the costs of what is learnt from: those that were measured, or else what can be told from the others.

    Args:
        measured: At least one.
        learn_from: ``gradients`` or ``rollouts``; None for what the first ones were measured with.

    Raises:
        InvalidValueError: See `Costs.adapted`.
        UnknownNameError: There is no such source.
    """
    first, *others = measured
    wanted = learn_from or first.learn_from
    found = next((one for one in (first, *others) if one.learn_from == wanted), None)
    return found if found is not None else first.adapted(learn_from=wanted)


_POSITIVE: Final = frozenset({"parameters", "frames"})
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
