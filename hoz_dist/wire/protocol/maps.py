"""Specs of fields that hold maps whose names are not known beforehand."""

import math
from dataclasses import dataclass
from typing import Any

from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import MOST_CHARACTERS, MOST_ELEMENTS, Int, Scalar, Text, wrong_type


@dataclass(frozen=True)
class Counts(Scalar):
    """A map of at most ``most`` short texts to counts."""

    most: int = 64

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not dict:
            raise wrong_type(where, "a map", value)
        if len(value) > self.most:
            raise RejectedError(Reason.SIZE, f"{where} has {len(value)} entries, more than {self.most}")
        for name, count in value.items():
            Text(64).check(name, f"a name in {where}")
            Int().check(count, f"{where}[{name}]")


@dataclass(frozen=True)
class JsonObject(Scalar):
    """A map of texts to what JSON can hold, at most ``deepest`` levels."""

    deepest: int = 4

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not dict:
            raise wrong_type(where, "a map", value)
        self._check_any(value, where, self.deepest)

    def _check_any(self, value: Any, where: str, levels: int) -> None:
        if levels < 0:
            raise RejectedError(Reason.SIZE, f"{where} is nested too deep")
        match value:
            case dict() | list() if len(value) > MOST_ELEMENTS:
                raise RejectedError(Reason.SIZE, f"{where} has {len(value)} elements, more than {MOST_ELEMENTS}")
            case dict():
                for name, element in value.items():
                    Text(128).check(name, f"a name in {where}")
                    self._check_any(element, f"{where}.{name}", levels - 1)
            case list():
                for element in value:
                    self._check_any(element, where, levels - 1)
            case float() if not math.isfinite(value):
                raise RejectedError(Reason.NONFINITE, f"{where} is {value}")
            case str():
                Text(MOST_CHARACTERS).check(value, where)
            case None | bool() | int() | float():
                pass
            case _:
                raise wrong_type(where, "a JSON value", value)
