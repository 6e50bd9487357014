"""Recognises pushes that were sent again, in bounded memory."""

from collections import Counter, OrderedDict
from collections.abc import Iterable
from typing import Final, NamedTuple

WINDOW: Final = 64
"""How far behind an incarnation's newest sequence number a first arrival is still told from a repeated one."""
MAX_SENDERS: Final = 4096
"""Senders remembered. Of the actor that has most of them, the one that was silent longest is forgotten first: whoever
invents incarnations pushes out its own."""


class Sender(NamedTuple):
    """One stream of numbered pushes."""

    kind: str
    """Gradients, rollouts, episodes and room graphs are numbered apart."""
    actor: str
    incarnation: int
    """Differs each time that the actor's process starts."""


class SeenPushes:
    """Which sequence numbers were taken, per sender: the newest, and a bit for each of the `WINDOW` up to it.

    Sequence numbers are not negative. A push that overtook another by less than `WINDOW` numbers is told apart from a
    repeated one; anything older counts as repeated, since senders keep few pushes in flight.
    """

    def __init__(self, rows: Iterable[Iterable[object]] = ()) -> None:
        """Continue from rows that `rows` returned.

        Raises:
            ValueError: They are something else.
        """
        self._seen: OrderedDict[Sender, tuple[int, int]] = OrderedDict()
        for row in rows:
            match tuple(row):
                case (str(kind), str(actor), int(incarnation), int(newest), int(taken)):
                    self._seen[Sender(kind, actor, incarnation)] = (newest, taken)
                case other:
                    message = f"not a row of the table of seen pushes: {other!r}"
                    raise ValueError(message)

    def __contains__(self, push: tuple[Sender, int]) -> bool:
        """Tell whether a push, (sender, sequence), was taken before."""
        sender, sequence = push
        if sender not in self._seen:
            return False
        newest, taken = self._seen[sender]
        behind = newest - sequence
        return behind >= WINDOW or (behind >= 0 and bool(taken >> behind & 1))

    def add(self, sender: Sender, sequence: int) -> None:
        """Remember a push as taken."""
        newest, taken = self._seen.pop(sender, (sequence, 0))
        if sequence > newest:
            taken = (taken << min(sequence - newest, WINDOW)) & ((1 << WINDOW) - 1)
            newest = sequence
        self._seen[sender] = (newest, taken | 1 << newest - sequence)
        if len(self._seen) > MAX_SENDERS:
            ((most, _),) = Counter(known.actor for known in self._seen).most_common(1)
            del self._seen[next(known for known in self._seen if known.actor == most)]

    def rows(self) -> list[list[object]]:
        """Return the table as JSON values, the sender that was silent longest first."""
        return [[*sender, newest, taken] for sender, (newest, taken) in self._seen.items()]
