"""The service as it is deployed: router, learners and actors, each a process of its own."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.sim.view_store import ViewStore
from tests.campaigns.journals import Acknowledged, read_journal
from tests.campaigns.supervisor import Program, Supervisor
from tests.integration.commands import SMALL_ROOMS

CHECKPOINT_S: Final = 2.0
ROUTER: Final = "router"
Place = Callable[[str], tuple[str, ...]]
"""Gives the command that a program of some name is run by; see `Program.within`."""


def prepare_views(cache: Path) -> None:
    """Render the rooms that the actors train in, so that all of them start at once and alike."""
    store, encoder = ViewStore(cache), load_encoder("pooled", None)
    for room in SMALL_ROOMS:
        store.open(RoomId.parse(room), encoder)


class Cluster:
    """Makes the programs of one service, and knows where their files are.

    Args:
        folder: For everything that the service writes.
        cache: The view cache.
        endpoint: Of the router.
        place: Where each program runs.
    """

    def __init__(self, folder: Path, cache: Path, endpoint: str, place: Place = lambda _: ()) -> None:
        self.run = folder / "run"
        self.logs = folder / "logs"
        self.endpoint = endpoint
        self._folder, self._cache, self._place = folder, cache, place
        self._folder.mkdir(parents=True, exist_ok=True)

    def router(self, *listen: str) -> Program:
        """A router; it listens at the endpoint unless others are given."""
        words = [word for endpoint in listen or (self.endpoint,) for word in ("--listen", endpoint)]
        return self._program(ROUTER, "router", *words)

    def learner(self, name: str, *options: str) -> Program:
        """A learner that is a client of the router."""
        return self._program(
            *(name, "learner", "--connect", self.endpoint, "--run", str(self.run), "--name", name),
            *("--zones", "3", "--checkpoint-seconds", f"{CHECKPOINT_S:g}", *options),
        )

    def actor(self, name: str, endpoint: str | None = None) -> Program:
        """An actor with a journal."""
        rooms = [word for room in SMALL_ROOMS for word in ("--scene", room)]
        return self._program(
            *(name, "actor", "--connect", endpoint or self.endpoint, "--name", name, *rooms),
            *("--cache", str(self._cache), "--journal", str(self.journal(name))),
        )

    def journal(self, actor: str) -> Path:
        """Where an actor, all its processes one after another, writes down what was acknowledged."""
        return self._folder / f"{actor}.jsonl"

    def acknowledged(self, *actors: str) -> list[Acknowledged]:
        """Return all pushes of actors that were acknowledged so far."""
        return [push for actor in actors if self.journal(actor).exists() for push in read_journal(self.journal(actor))]

    def _program(self, name: str, *words: str) -> Program:
        return Program(name, words, self._place(name))


def start(supervisor: Supervisor, *programs: Program) -> None:
    """Start programs in this order."""
    for program in programs:
        supervisor.start(program)
