"""What a field of a message may hold: one small class per type of field.

A message states its fields as ``name: Annotated[python type, spec]``. Each spec turns a value into what msgpack can
hold (`pack`), back (`unpack`: structure only), and judges a value (`check`). A message checks all its fields whenever
it is made, so what is sent and what is received obey the same rules, and a large tensor is looked at only once.
"""

import abc
import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Annotated, Any, ClassVar, Final, Protocol, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from hoz_dist.wire.protocol.rejection import CONTROL, Reason, RejectedError, shown

MAX_INT: Final = 2**63 - 1
MOST_ELEMENTS: Final = 4096
"""Longest list or map anywhere in a message; a field's own limit is at most this."""
MOST_CHARACTERS: Final = 4096
"""Longest text anywhere in a message; a field's own limit is at most this."""
DTYPES: Final[Mapping[str, np.dtype[Any]]] = {
    "float32": np.dtype("<f4"),
    "float64": np.dtype("<f8"),
    "bfloat16": np.dtype("<u2"),
    "int8": np.dtype("i1"),
    "uint8": np.dtype("u1"),
    "uint16": np.dtype("<u2"),
    "uint32": np.dtype("<u4"),
}
"""Element types by their name on the wire, and what holds them here; always little-endian.

NumPy has no bfloat16: an array of them holds their bits, the upper half of those of the float32.
"""


class Spec(Protocol):
    """What a field may hold."""

    def pack(self, value: Any) -> object:
        """Return what msgpack can hold for a value that `check` accepts."""
        ...

    def unpack(self, raw: object, where: str) -> object:
        """Return the value for what msgpack held.

        Raises:
            RejectedError: The structure is not that of a value.
        """
        ...

    def check(self, value: Any, where: str) -> None:
        """Judge a value.

        Raises:
            RejectedError: The value is not allowed.
        """
        ...


class Nest(abc.ABC):
    """Base of the specs whose values are maps of fields that have specs themselves."""

    @abc.abstractmethod
    def inner(self, raw: Mapping[str, Any]) -> Mapping[str, Spec]:
        """Return the specs of the fields of a map, which may hold anything."""


class Scalar:
    """Base of the specs whose values msgpack holds as they are."""

    def pack(self, value: Any) -> object:
        """Return the value itself."""
        return value

    def unpack(self, raw: object, where: str) -> object:  # noqa: ARG002 - the field's name is for specs that can fail
        """Return the value itself."""
        return raw


@dataclasses.dataclass(frozen=True)
class Int(Scalar):
    """A whole number from ``low`` to ``high``, both included."""

    low: int = 0
    high: int = MAX_INT

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not int:  # bool is an int to Python, not on the wire
            raise wrong_type(where, "a whole number", value)
        if not self.low <= value <= self.high:
            raise RejectedError(Reason.RANGE, f"{where} is {value}, not in {self.low}..{self.high}")


@dataclasses.dataclass(frozen=True)
class Real(Scalar):
    """A finite number from ``low`` to ``high``, both included."""

    low: float = -math.inf
    high: float = math.inf

    def unpack(self, raw: object, where: str) -> object:  # noqa: ARG002 - as in Scalar
        """Return a float; languages with one number type send 2.0 as 2."""
        return float(raw) if type(raw) is int else raw

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not float:
            raise wrong_type(where, "a number", value)
        if not math.isfinite(value):
            raise RejectedError(Reason.NONFINITE, f"{where} is {value}")
        if not self.low <= value <= self.high:
            raise RejectedError(Reason.RANGE, f"{where} is {value}, not in {self.low}..{self.high}")


@dataclasses.dataclass(frozen=True)
class Bool(Scalar):
    """True or false."""

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not bool:
            raise wrong_type(where, "true or false", value)


@dataclasses.dataclass(frozen=True)
class Text(Scalar):
    """A text of one line and at most ``longest`` characters, all of it of a pattern where one is given."""

    longest: int = 256
    pattern: re.Pattern[str] | None = None

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not str:
            raise wrong_type(where, "a text", value)
        if len(value) > self.longest:
            raise RejectedError(Reason.SIZE, f"{where} has {len(value)} characters, more than {self.longest}")
        if CONTROL.search(value) or (self.pattern is not None and not self.pattern.fullmatch(value)):
            raise RejectedError(Reason.NAME, f"{where} is not well formed: {value[:80]!r}")


@dataclasses.dataclass(frozen=True)
class OneOf(Scalar):
    """One of some known names."""

    names: frozenset[str]

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if not isinstance(value, str):  # a member of a StrEnum will do
            raise wrong_type(where, "a text", value)
        if value not in self.names:
            raise RejectedError(Reason.NAME, f"{where} is unknown: {value[:80]!r}")


@dataclasses.dataclass(frozen=True)
class Tensor:
    """An array of numbers, finite ones unless said otherwise.

    Attributes:
        dtype: Name of the element type in `DTYPES`.
        rank: Number of axes.
        most: Largest number of elements.
        low: Smallest element allowed.
        high: Largest element allowed.
        bulk: Whether the elements stand behind the message's map instead of in it; see `hoz_dist.wire.protocol.bulk`.
        finite: Whether every element must be finite; False where who receives the array finds that out anyway.

    For ``bfloat16`` nothing is judged of the elements: NumPy has only their bits.
    """

    dtype: str
    rank: int
    most: int
    low: float = -math.inf
    high: float = math.inf
    bulk: bool = False
    finite: bool = True

    DESCRIPTION: ClassVar[frozenset[str]] = frozenset({"dtype", "shape"})
    FIELDS: ClassVar[frozenset[str]] = DESCRIPTION | {"data"}

    def __post_init__(self) -> None:
        """Refuse what `check` could not judge.

        Raises:
            ValueError: Something is wanted of elements that are ``bfloat16``.
        """
        if self.dtype == "bfloat16" and (self.low, self.high, self.finite) != (-math.inf, math.inf, False):
            message = "a tensor of bfloat16 has no bounds, and may hold what is not finite"
            raise ValueError(message)

    def pack(self, value: NDArray[Any]) -> object:
        """Return the map of dtype, shape and raw bytes, the bytes as a view, so that msgpack makes the only copy.

        Of a bulk tensor these are `Bulky`: who lays the message out puts the bytes elsewhere.
        """
        array = np.ascontiguousarray(value, DTYPES[self.dtype])
        data = array.reshape(-1).data.cast("B")
        description: dict[str, object] = {"dtype": self.dtype, "shape": list(array.shape)}
        return Bulky(description, data) if self.bulk else description | {"data": data}

    def unpack(self, raw: object, where: str) -> object:
        """Return a read-only array on the received bytes."""
        fields = map_of(raw, self.FIELDS, where)
        data = fields["data"]
        size = self.bytes_of(fields, where)
        if not isinstance(data, bytes | memoryview):
            raise RejectedError(Reason.TYPE, f"{where}.data is not bytes but {type(data).__name__}")
        if len(data) != size:
            raise RejectedError(Reason.SHAPE, f"{where} has {len(data)} bytes for the shape {fields['shape']}")
        return np.frombuffer(data, DTYPES[self.dtype]).reshape(fields["shape"])

    def bytes_of(self, description: Mapping[str, Any], where: str) -> int:
        """Return how many bytes the elements of a tensor take that is described so.

        Raises:
            RejectedError: It is not described as a tensor of this spec.
        """
        shape = description["shape"]
        if description["dtype"] != self.dtype:
            raise RejectedError(Reason.DTYPE, f"{where} is {shown(description['dtype'])}, not {self.dtype}")
        if type(shape) is not list or len(shape) != self.rank:
            raise RejectedError(Reason.SHAPE, f"{where} has no shape of {self.rank} axes")
        if not all(type(side) is int and 0 < side <= self.most for side in shape):
            # A side of 0 would excuse any other, also one that NumPy cannot hold.
            raise RejectedError(Reason.SHAPE, f"{where} has a side that is not in 1..{self.most}")
        return math.prod(shape) * DTYPES[self.dtype].itemsize

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if not isinstance(value, np.ndarray):
            raise wrong_type(where, "an array", value)
        if value.dtype != DTYPES[self.dtype]:
            raise RejectedError(Reason.DTYPE, f"{where} is {value.dtype}, not {self.dtype}")
        if value.ndim != self.rank or value.size == 0:
            raise RejectedError(Reason.SHAPE, f"{where} has the shape {value.shape}, not {self.rank} filled axes")
        if value.size > self.most:
            raise RejectedError(Reason.SIZE, f"{where} has {value.size} elements, more than {self.most}")
        if self.finite and not _all_finite(value):
            raise RejectedError(Reason.NONFINITE, f"{where} holds NaN or infinity")
        if (self.low > -math.inf and value.min() < self.low) or (self.high < math.inf and value.max() > self.high):
            raise RejectedError(Reason.RANGE, f"{where} has an element that is not in {self.low}..{self.high}")


@dataclasses.dataclass(frozen=True)
class Bulky:
    """A packed bulk tensor."""

    description: dict[str, object]
    """What stands in the map: dtype and shape."""
    data: memoryview
    """What stands behind it: the raw bytes."""


@dataclasses.dataclass(frozen=True)
class Many:
    """A tuple of at most ``most`` values of one spec; a list on the wire."""

    of: Spec
    most: int

    def pack(self, value: Sequence[Any]) -> object:
        """Return the list of the packed values."""
        return [self.of.pack(element) for element in value]

    def unpack(self, raw: object, where: str) -> object:
        """Return the tuple of the unpacked values."""
        if type(raw) is not list:
            raise wrong_type(where, "a list", raw)
        if len(raw) > self.most:
            raise RejectedError(Reason.SIZE, f"{where} has {len(raw)} elements, more than {self.most}")
        return tuple(self.of.unpack(element, f"{where}[{index}]") for index, element in enumerate(raw))

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not tuple:
            raise wrong_type(where, "a tuple", value)
        if len(value) > self.most:
            raise RejectedError(Reason.SIZE, f"{where} has {len(value)} elements, more than {self.most}")
        for index, element in enumerate(value):
            self.of.check(element, f"{where}[{index}]")


@dataclasses.dataclass(frozen=True)
class Record(Nest):
    """A nested `Structure`; a map on the wire."""

    of: "type[Structure]"

    def pack(self, value: "Structure") -> object:
        """Return the map of the packed fields."""
        return value.pack()

    def unpack(self, raw: object, where: str) -> object:
        """Return the structure, checked."""
        return self.of.unpack(raw, where)

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`. A structure has checked itself when it was made."""
        if type(value) is not self.of:
            raise wrong_type(where, self.of.__name__, value)

    def inner(self, raw: Mapping[str, Any]) -> Mapping[str, Spec]:  # noqa: ARG002 - all such structures have the same
        """Return the specs of the structure's fields."""
        return self.of.SPECS


class Structure:
    """Base of frozen dataclasses whose fields are ``name: Annotated[type, spec]``; checked whenever one is made.

    Attributes:
        SPECS: The spec of each field.
        OPTIONAL: Fields whose default is None, which on the wire is a field that is left out: so peers that do not know
            a field yet are understood.
    """

    SPECS: ClassVar[dict[str, Spec]] = {}
    OPTIONAL: ClassVar[frozenset[str]] = frozenset()

    def __init_subclass__(cls) -> None:
        """Gather the specs of the fields, inherited ones first."""
        hints = get_type_hints(cls, include_extras=True)
        cls.SPECS = {name: get_args(hint)[1] for name, hint in hints.items() if get_origin(hint) is Annotated}
        cls.OPTIONAL = frozenset(name for name in cls.SPECS if getattr(cls, name, ...) is None)

    def __post_init__(self) -> None:
        for name in self._filled():
            self.SPECS[name].check(getattr(self, name), name)

    def _filled(self) -> list[str]:
        return [name for name in self.SPECS if name not in self.OPTIONAL or getattr(self, name) is not None]

    def pack(self) -> dict[str, object]:
        """Return the map of the packed fields."""
        return {name: self.SPECS[name].pack(getattr(self, name)) for name in self._filled()}

    @classmethod
    def unpack(cls, raw: object, where: str) -> "Structure":
        """Make the structure from what msgpack held.

        Raises:
            RejectedError: Anything is not as it should be.
        """
        fields = map_of(raw, cls.SPECS.keys() - cls.OPTIONAL, where, cls.OPTIONAL)
        values = {name: spec.unpack(fields[name], name) for name, spec in cls.SPECS.items() if name in fields}
        for name in cls.OPTIONAL & values.keys():
            cls.SPECS[name].check(values[name], name)  # a None that is there was not left out
        return cls(**values)


def map_of(
    raw: object, names: AbstractSet[str], where: str, optional: AbstractSet[str] = frozenset()
) -> dict[str, Any]:
    """Return a map that has exactly those names, and perhaps optional ones."""
    if type(raw) is not dict:
        raise wrong_type(where, "a map", raw)
    missing, unknown = names - raw.keys(), raw.keys() - names - optional
    if missing or unknown:
        told = [f"missing {', '.join(sorted(missing))}"] if missing else []
        told += [f"unknown {', '.join(sorted(map(shown, unknown)))[:200]}"] if unknown else []
        raise RejectedError(Reason.FIELDS, f"{where} has {' and '.join(told)}")
    return raw


def _all_finite(array: NDArray[Any]) -> bool:
    """Return whether every element is finite; the sum of squares says so in one pass, unless it overflows."""
    if array.dtype.kind != "f":
        return True
    flat = array.reshape(-1)
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(np.dot(flat, flat))) or bool(np.isfinite(flat).all())


def wrong_type(where: str, wanted: str, value: object) -> RejectedError:
    """Return the rejection of a value of another type than a field holds."""
    return RejectedError(Reason.TYPE, f"{where} is not {wanted} but {type(value).__name__}")
