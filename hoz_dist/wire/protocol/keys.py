"""Key expressions: where on the network each part of a run is found."""

import re
from dataclasses import dataclass
from typing import Final

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.rooms import RoomId

ROOT: Final = "hoz"
NAME_PATTERN: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
"""Run names, actor names and roles. None of Zenoh's special characters (``* $ ? # @ /``) can occur."""
NOBODY: Final = "(unnamed)"
"""Stands for the sender of a message whose key names none; no actor can be called so."""
ALL_CONFIGS: Final = f"{ROOT}/*/config"
"""Selects the configuration of every run that can be reached."""


def check_name(what: str, name: str) -> str:
    """Return a name that is fit to be one chunk of a key expression.

    Args:
        what: What it names, for the error: ``"run"``, ``"actor"``, ...
        name: The name.

    Raises:
        InvalidValueError: The name has a character that a key cannot hold, or is too long.
    """
    if not NAME_PATTERN.fullmatch(name):
        message = (
            f"The {what} name '{name}' cannot be used on the network: "
            "use 1 to 64 letters, digits, '.', '_' or '-', and start with a letter or digit."
        )
        raise InvalidValueError(message)
    return name


def sender_of(key: str) -> str:
    """Return the actor that a push on a key comes from: ``hoz/{run}/{grads, rollouts or rooms}/{actor}/...``.

    A key expression without an actor's name, such as ``hoz/**``, gives `NOBODY`.
    """
    parts = key.split("/")
    return parts[3] if len(parts) > 3 and NAME_PATTERN.fullmatch(parts[3]) else NOBODY  # noqa: PLR2004 - see above


def run_of(key: str) -> str:
    """Return the run that a concrete key belongs to."""
    return key.split("/")[1]


SEEN_SEPARATOR: Final = "+"
"""Stands between the categories that are seen, in a question for a plan."""


@dataclass(frozen=True)
class Keys:
    """The key expressions of one run.

    Attributes:
        run: Name of the run, the last part of the learner's run folder.

    Raises:
        InvalidValueError: The run's name is not fit for a key.
    """

    run: str

    def __post_init__(self) -> None:
        check_name("run", self.run)

    @property
    def config(self) -> str:
        """What an actor needs to join."""
        return f"{ROOT}/{self.run}/config"

    @property
    def params(self) -> str:
        """The head of the newest parameters."""
        return f"{ROOT}/{self.run}/params"

    @property
    def all_params(self) -> str:
        """The head of the newest parameters, and shards."""
        return f"{self.params}/**"

    def shard(self, index: int) -> str:
        """One shard of parameters."""
        return f"{self.params}/{index}"

    @property
    def all_grads(self) -> str:
        """Gradients of every actor."""
        return self.grads("*")

    def grads(self, actor: str) -> str:
        """Gradients of one actor."""
        return f"{ROOT}/{self.run}/grads/{actor}"

    @property
    def all_rollouts(self) -> str:
        """Finished episodes of every actor."""
        return self.rollouts("*")

    def rollouts(self, actor: str) -> str:
        """Finished episodes of one actor."""
        return f"{ROOT}/{self.run}/rollouts/{actor}"

    @property
    def all_rooms(self) -> str:
        """Room graphs that actors push."""
        return f"{ROOT}/{self.run}/rooms/*/*/*"

    def room(self, actor: str, room: RoomId) -> str:
        """The graph of one room that one actor pushes."""
        return f"{ROOT}/{self.run}/rooms/{actor}/{room}"

    @property
    def all_graphs(self) -> str:
        """Scene graphs and room graphs that the learner serves."""
        return self.graph("**")

    def graph(self, name: str) -> str:
        """The graph of a scene (``kitchen``) or of a room (``kitchen/3``)."""
        return f"{ROOT}/{self.run}/graphs/{name}"

    @property
    def all_plans(self) -> str:
        """Plans in every scene."""
        return self.plan("*")

    def plan(self, scene: str) -> str:
        """Plans in one scene."""
        return f"{ROOT}/{self.run}/plan/{scene}"

    @property
    def status(self) -> str:
        """Who takes part and how it goes."""
        return f"{ROOT}/{self.run}/status"

    @property
    def all_alive(self) -> str:
        """Liveliness tokens of every process."""
        return f"{ROOT}/{self.run}/alive/*/*/*/*"

    def alive(self, role: str, name: str, host: str, incarnation: int) -> str:
        """Liveliness token of one process."""
        return f"{ROOT}/{self.run}/alive/{role}/{name}/{host}/{incarnation}"
