"""Which categories are related, for method `sp`: reading them from files, and their graph.

In a configuration, and so in a run's folder and on the wire, relations are pairs such as ``Bowl+Plate``: who joins or
evaluates a run needs no file.
"""

import json
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.nav.categories import TARGETS

LEAST_COUNT: Final = 3
"""How often a relation must be counted to matter [Yang et al. 2019, 3.2]."""
SHIPPED: Final = Path(__file__).with_name("relations.json")
"""Made of the training rooms by ``python -m hoz_dist.sim.closeness``."""

_SYNONYMS: Final[dict[str, str]] = {
    "alarm clock": "AlarmClock",
    "clock": "AlarmClock",
    "cell phone": "CellPhone",
    "cellphone": "CellPhone",
    "mobile phone": "CellPhone",
    "phone": "CellPhone",
    "coffee machine": "CoffeeMachine",
    "coffee maker": "CoffeeMachine",
    "coffeemaker": "CoffeeMachine",
    "desk lamp": "DeskLamp",
    "table lamp": "DeskLamp",
    "lamp": "DeskLamp",
    "floor lamp": "FloorLamp",
    "refrigerator": "Fridge",
    "garbage can": "GarbageCan",
    "trash can": "GarbageCan",
    "trash bin": "GarbageCan",
    "wastebasket": "GarbageCan",
    "bin": "GarbageCan",
    "tea kettle": "Kettle",
    "laptop computer": "Laptop",
    "light switch": "LightSwitch",
    "microwave oven": "Microwave",
    "frying pan": "Pan",
    "remote": "RemoteControl",
    "remote control": "RemoteControl",
    "burner": "StoveBurner",
    "stove burner": "StoveBurner",
    "stove": "StoveBurner",
    "tv": "Television",
} | {name.lower(): name for name in TARGETS}
"""Names of objects in Visual Genome, in the singular, that mean one of our categories."""

Counted = tuple[str, str, str, int]
"""A category, a relation, another category, and how often that was counted."""


@cache
def shipped_relations() -> tuple[str, ...]:
    """Return the relations counted in the training rooms."""
    return read_relations(SHIPPED)


def read_relations(path: Path) -> tuple[str, ...]:
    """Read which categories have a relation, in either direction, that is counted at least `LEAST_COUNT` times.

    Args:
        path: JSON, in one of two forms. ``[[a, relation, b, count], ...]``, or Visual Genome's ``relationships.json``:
            ``[{"relationships": [{"predicate": ..., "subject": {"name": ...}, "object": {"name": ...}}, ...]}, ...]``
            (some versions say ``"names": [...]``). Objects that are none of our categories do not count. All of the
            file is held in memory.

    Returns:
        Pairs such as ``Bowl+Plate``, in the order of `TARGETS`.

    Raises:
        NotFoundError: The file cannot be read.
        InvalidValueError: It is of neither form, or relates no two of our categories.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        message = f"The relations {path} cannot be read ({error.strerror}); give another file to --relations."
        raise NotFoundError(message) from error
    except ValueError:
        content = None
    try:
        counts: Counter[tuple[str, str]] = Counter()
        for (pair, _), count in _by_relation(_rows(content)).items():
            counts[pair] = max(counts[pair], count)
    except (TypeError, ValueError, KeyError, IndexError) as error:
        message = (
            f'{path} holds no relations: it must be JSON such as [["Bowl", "near", "Plate", 5]], or Visual Genome\'s '
            "relationships.json."
        )
        raise InvalidValueError(message) from error
    pairs = sorted((TARGETS.index(a), TARGETS.index(b)) for (a, b), count in counts.items() if count >= LEAST_COUNT)
    if not pairs:
        message = f"{path} relates no two of our categories at least {LEAST_COUNT} times; `sp` needs some that are."
        raise InvalidValueError(message)
    return tuple(f"{TARGETS[a]}+{TARGETS[b]}" for a, b in pairs)


def check_relations(relations: Iterable[str]) -> None:
    """Check that every relation is a pair of categories.

    Raises:
        InvalidValueError: One is not.
    """
    for relation in relations:
        first, _, second = relation.partition("+")
        if first not in TARGETS or second not in TARGETS or TARGETS.index(first) >= TARGETS.index(second):
            message = f"'{relation}' is no relation: write two categories in their order, such as Bowl+Plate."
            raise InvalidValueError(message)


def relation_matrix(relations: Iterable[str]) -> NDArray[np.float64]:
    """Return the graph of some relations: 1 for related categories and on the diagonal, [N, N], symmetric."""
    matrix = np.eye(len(TARGETS))
    for relation in relations:
        first, second = (TARGETS.index(name) for name in relation.split("+"))
        matrix[first, second] = matrix[second, first] = 1.0
    return matrix


def _rows(content: Any) -> Iterator[Counted]:
    """Read either form; raises a `TypeError`, `ValueError`, `KeyError` or `IndexError` where it is of neither."""
    if not isinstance(content, list):
        raise TypeError
    for entry in content:
        if isinstance(entry, dict):
            for one in entry["relationships"]:
                yield _name(one["subject"]), str(one["predicate"]).lower(), _name(one["object"]), 1
        else:
            first, relation, second, count = entry
            if type(count) is not int:
                raise TypeError
            yield str(first), str(relation).lower(), str(second), count


def _name(thing: dict[str, Any]) -> str:
    return str(thing["name"] if "name" in thing else thing["names"][0])


def _by_relation(rows: Iterable[Counted]) -> Counter[tuple[tuple[str, str], str]]:
    """Count each relation of two different categories, whichever comes first."""
    counts: Counter[tuple[tuple[str, str], str]] = Counter()
    for first, relation, second, count in rows:
        a, b = _category(first), _category(second)
        if a is not None and b is not None and a != b:
            pair = (a, b) if TARGETS.index(a) < TARGETS.index(b) else (b, a)
            counts[pair, relation] += count
    return counts


def _category(name: str) -> str | None:
    """Return which of our categories an object of some name is, if any."""
    words = " ".join(name.lower().split())
    return _SYNONYMS.get(words) or _SYNONYMS.get(words.removesuffix("s"))
