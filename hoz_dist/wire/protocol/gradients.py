"""The spec of a gradient: a map of the codec's name and of what this codec needs."""

from collections.abc import Mapping
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from hoz_dist.gradient_forms import Bf16Gradient, Gradient, Int8Gradient, TopKGradient, blocks_of
from hoz_dist.wire.protocol.message import MAX_PARAMETERS
from hoz_dist.wire.protocol.rejection import Reason, RejectedError, shown
from hoz_dist.wire.protocol.schema import Int, Nest, Spec, Tensor, map_of, wrong_type

LARGEST_SCALE: Final = 2.0**120
"""Of an `Int8Gradient`: 127 steps of that size are still finite."""
# Whether the entries of a gradient are finite the learner learns from its norm: a pass over all of them less.
_HALVES: Final = Tensor("bfloat16", rank=1, most=MAX_PARAMETERS, bulk=True, finite=False)


class _Form(NamedTuple):
    """One codec."""

    made_of: type
    """What holds a gradient here."""
    fields: Mapping[str, Spec]
    """Specs of its fields."""


class GradientField(Nest):
    """Spec of a `Gradient`; on the wire a map of ``codec`` and the fields of the form, bulk tensors among them."""

    FORMS: ClassVar[Mapping[str, _Form]] = {
        "fp32": _Form(np.ndarray, {"values": Tensor("float32", rank=1, most=MAX_PARAMETERS, bulk=True, finite=False)}),
        "bf16": _Form(Bf16Gradient, {"halves": _HALVES}),
        "int8": _Form(
            Int8Gradient,
            {
                "levels": Tensor("int8", rank=1, most=MAX_PARAMETERS, low=-127, bulk=True),
                "scales": Tensor(
                    "float32", rank=1, most=blocks_of(MAX_PARAMETERS), low=0.0, high=LARGEST_SCALE, bulk=True
                ),
            },
        ),
        "topk": _Form(
            TopKGradient,
            {
                "size": Int(1, MAX_PARAMETERS),
                "indices": Tensor("uint32", rank=1, most=MAX_PARAMETERS, bulk=True),
                "halves": _HALVES,
            },
        ),
    }

    def pack(self, value: Gradient) -> object:
        """Return the map of the codec's name and the packed fields."""
        codec = codec_of(value)
        fields = _fields_of(value)
        return {"codec": codec} | {name: spec.pack(fields[name]) for name, spec in self.FORMS[codec].fields.items()}

    def unpack(self, raw: object, where: str) -> object:
        """Return the gradient, its arrays read-only on the received bytes."""
        form = self._form(raw, where)
        fields = map_of(raw, {"codec", *form.fields}, where)
        values = {name: spec.unpack(fields[name], name) for name, spec in form.fields.items()}
        return values["values"] if form.made_of is np.ndarray else form.made_of(**values)

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        codec = codec_of(value)
        fields = _fields_of(value)
        for name, spec in self.FORMS[codec].fields.items():
            spec.check(fields[name], where if codec == "fp32" else f"{where}.{name}")
        match value:
            case Int8Gradient(levels, scales) if scales.size != blocks_of(levels.size):
                detail = f"{where} has {scales.size} scales; {levels.size} entries need {blocks_of(levels.size)}"
                raise RejectedError(Reason.SHAPE, detail)
            case TopKGradient():
                _check_places(value, where)

    def inner(self, raw: Mapping[str, Any]) -> Mapping[str, Spec]:
        """Return the specs of the fields that a map has besides its codec; none when there is no such codec."""
        codec = raw.get("codec")
        return self.FORMS[codec].fields if isinstance(codec, str) and codec in self.FORMS else {}

    def _form(self, raw: object, where: str) -> _Form:
        """Return the form that the codec of a map names."""
        if type(raw) is not dict:
            raise wrong_type(where, "a map", raw)
        if "codec" not in raw:
            raise RejectedError(Reason.FIELDS, f"{where} has missing codec")
        codec = raw["codec"]
        if type(codec) is not str:
            raise RejectedError(Reason.TYPE, f"{where}.codec is not a text but {type(codec).__name__}")
        if codec not in self.FORMS:
            raise RejectedError(Reason.NAME, f"{where}.codec is unknown: {shown(codec)}")
        return self.FORMS[codec]


def codec_of(gradient: Gradient) -> str:
    """Return the name of the codec whose form a gradient has.

    Raises:
        RejectedError: It is no gradient.
    """
    for codec, form in GradientField.FORMS.items():
        if isinstance(gradient, form.made_of):
            return codec
    raise RejectedError(Reason.TYPE, f"gradient is not a gradient but {type(gradient).__name__}")


def _fields_of(gradient: Gradient) -> Mapping[str, Any]:
    return {"values": gradient} if isinstance(gradient, np.ndarray) else gradient._asdict()


def _check_places(gradient: TopKGradient, where: str) -> None:
    """Judge whether the entries of a gradient are different ones of it."""
    indices = gradient.indices
    if indices.size != gradient.halves.size:
        detail = f"{where} has {indices.size} indices and {gradient.halves.size} values"
        raise RejectedError(Reason.SHAPE, detail)
    if not (indices[1:] > indices[:-1]).all():
        raise RejectedError(Reason.RANGE, f"{where}.indices do not ascend")
    if indices[-1] >= gradient.size:
        raise RejectedError(Reason.RANGE, f"{where}.indices has {indices[-1]}, and there are {gradient.size} entries")
