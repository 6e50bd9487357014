"""What each actor's last rollout ended with, so that recurrent states need not travel."""

from collections import OrderedDict
from typing import Final, NamedTuple, Self

from torch import Tensor

from hoz_dist.policy.navigator import ZoneState
from hoz_dist.policy.state import State
from hoz_dist.wire.protocol.pushes import Push

MOST_STATES: Final = 4096
MOST_STATE_BYTES: Final = 256 * 1024 * 1024
"""Of all states; those of the paper's sizes and 64 episodes have 0.6 MB, with the memory of TPN 3 MB."""


class Ended(NamedTuple):
    """The state after a rollout."""

    incarnation: int
    sequence: int
    """Of the rollout."""
    state: State
    known: Tensor
    """Of which episodes the state is known, bool [B]: not of those that run since before the learner saw any step."""

    @classmethod
    def after(cls, push: Push, state: State, known: Tensor) -> Self:
        """Return what a rollout ended with, in memory of its own."""
        zone = ZoneState(*(part.clone() for part in state.zone))
        memory = tuple(part.clone() for part in state.memory)
        return cls(
            push.incarnation,
            push.sequence,
            State(state.lstm.clone(), zone, memory, state.target_seen.clone()),
            known.clone(),
        )

    @property
    def size(self) -> int:
        """Bytes that it takes."""
        tensors = (self.state.lstm, *self.state.zone, *self.state.memory, self.state.target_seen, self.known)
        return sum(tensor.numel() * tensor.element_size() for tensor in tensors)


class RolloutStates:
    """The state after the last rollout of each actor; of many actors, those that pushed last.

    A new process of an actor's name takes the place of the old one.

    Args:
        most: Largest number of states.
        most_bytes: Largest number of bytes of all states; one may always be kept.
    """

    def __init__(self, most: int = MOST_STATES, most_bytes: int = MOST_STATE_BYTES) -> None:
        self._most = most
        self._most_bytes = most_bytes
        self._states: OrderedDict[str, Ended] = OrderedDict()
        self._bytes = 0

    def __len__(self) -> int:
        return len(self._states)

    def before(self, actor: str, incarnation: int, sequence: int) -> Ended | None:
        """Return the state that a rollout begins with; None when the one before it was not seen, or is forgotten."""
        ended = self._states.get(actor)
        if ended is None or (ended.incarnation, ended.sequence + 1) != (incarnation, sequence):
            return None
        return ended

    def keep(self, actor: str, ended: Ended) -> None:
        """Remember the state after a rollout of an actor."""
        if actor in self._states:
            self._bytes -= self._states.pop(actor).size
        self._states[actor] = ended
        self._bytes += ended.size
        while len(self._states) > self._most or (self._bytes > self._most_bytes and len(self._states) > 1):
            _, oldest = self._states.popitem(last=False)
            self._bytes -= oldest.size

    def clear(self) -> None:
        """Forget all."""
        self._states.clear()
        self._bytes = 0
