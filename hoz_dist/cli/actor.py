"""`hoz-dist actor`: an actor process that trains in its rooms for a learner."""

import os
import re
import socket
from pathlib import Path
from typing import Final

import click

from hoz_dist.cli.connecting import connect_option, credentials_in, keys_option, run_option, shared_memory_option
from hoz_dist.cli.options import cache_option, weights_option
from hoz_dist.cli.stopping import stop_on_signals
from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.categories import SCENES

CONNECT_S: Final = 5.0
"""How long to try to reach the learner or router, seconds; it may be starting again."""


@click.command("actor")
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    required=True,
    metavar="SCENE|ROOM",
    help=f"Scene ({', '.join(SCENES)}: all its training rooms) or training room (kitchen/3); may be repeated.",
)
@connect_option
@keys_option
@run_option
@click.option(
    "--name",
    help="Name of this actor, unique in the run; its episodes follow from it and the run's seed.  "
    "[default: that of its key, else HOST-PID]",
)
@weights_option
@cache_option
@click.option(
    "--journal",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Append a JSON line for each push that the learner acknowledged.  [default: none]",
)
@click.option(
    "--timings",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Append a JSON line after each update that says what each stage of the work has taken.  [default: none]",
)
@shared_memory_option
@click.option("--live", is_flag=True, help="Render every step in PyBullet instead of looking it up; slow.")
def actor_command(
    scenes: tuple[str, ...],
    connect: str,
    keys: Path | None,
    run: str | None,
    name: str | None,
    weights: Path | None,
    cache: Path | None,
    journal: Path | None,
    timings: Path | None,
    *,
    shared_memory: bool,
    live: bool,
) -> None:
    """Explore and train in training rooms for the learner at ENDPOINT, until the run is over.

    Any number of actors may join, leave and come back. SIGINT and SIGTERM stop this one cleanly.
    """
    import logging
    from contextlib import ExitStack, suppress

    from hoz_dist.nav.rooms import training_rooms
    from hoz_dist.stages import StageClock
    from hoz_dist.waiting import StoppedError
    from hoz_dist.wire.transport.session import open_client
    from hoz_dist.wire.transport.shared_memory import SharedMemory

    rooms = training_rooms(scenes)
    credentials = credentials_in(keys, ["actor"])
    actor = credentials.own_name(name) if credentials else name or _default_name()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", datefmt="%H:%M:%S")
    stop = stop_on_signals()
    with (
        suppress(StoppedError),
        SharedMemory(on=shared_memory) as memory,
        open_client(connect, CONNECT_S, stop, credentials, shared_memory=memory.on) as session,
    ):
        # Only now, that somebody answers: these take seconds to import.
        from hoz_dist.evaluation.loading import matching_encoder
        from hoz_dist.policy.threads import use_one_thread
        from hoz_dist.sim.live import LiveViews
        from hoz_dist.sim.view_source import StoredViews
        from hoz_dist.sim.view_store import ViewStore, default_cache
        from workers.actor import Actor
        from workers.journal import Journal
        from workers.link import LearnerLink
        from workers.timings import Timings

        use_one_thread()
        clock = StageClock()
        with ExitStack() as stack:
            book = stack.enter_context(Journal(journal)) if journal is not None else None
            stages = stack.enter_context(Timings(timings, clock)) if timings is not None else None
            link = stack.enter_context(LearnerLink(session, actor, run, stop, book, memory, clock))
            if strange := [room for room in rooms if not link.config.tells(room.scene)]:
                message = (
                    f"The scene layer of run {link.run} has no output for {strange[0].scene}: join a run whose learner "
                    f"was started with --scenes {len(SCENES)}."
                )
                raise InvalidValueError(message)
            size = link.config.picture_size
            encoder = matching_encoder(link.config, weights)
            store = ViewStore(cache or default_cache(), size)
            source = stack.enter_context(LiveViews(encoder, size)) if live else StoredViews()
            logging.getLogger("hoz_dist").info("%s joins run %s with %d rooms", actor, link.run, len(rooms))
            Actor(link, rooms, store, encoder, source, actor, stop, clock, stages).run()


def _default_name() -> str:
    """Return HOST-PID, fit for a key expression: Kubernetes has host names that are as long as a name may be."""
    host = re.sub(r"[^A-Za-z0-9._-]", "-", socket.gethostname()).lstrip("._-")[:40]
    return f"{host or 'host'}-{os.getpid()}"
