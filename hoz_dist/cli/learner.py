"""`hoz-dist learner`: a learner process that actors, robots and queries connect to."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hoz_dist.cli.connecting import keys_option, shared_memory_option
from hoz_dist.cli.options import cache_option, keep_every_option
from hoz_dist.cli.run_options import run_config, run_options
from hoz_dist.cli.stopping import stop_on_signals
from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.categories import ROOM_SCENES, SCENES
from hoz_dist.wire.transport.endpoint import DEFAULT_ENCRYPTED_ENDPOINT, DEFAULT_ENDPOINT

if TYPE_CHECKING:
    from hoz_dist.config import RunConfig
    from hoz_dist.wire.transport.credentials import Credentials
    from learner.rooms import RoomSource


@click.command("learner")
@click.option(
    "--listen",
    metavar="ENDPOINT",
    help="Endpoint to listen at, as the router of the run, protocol/host:port.  "
    f"[default: {DEFAULT_ENDPOINT}, with --keys {DEFAULT_ENCRYPTED_ENDPOINT}]",
)
@click.option("--connect", metavar="ENDPOINT", help="Endpoint of a router to connect to, instead of listening.")
@click.option(
    "--standby",
    is_flag=True,
    help="Follow the learner that leads the run, and take over when it is gone; needs --connect and the same run "
    "folder. Without a leader, lead at once.",
)
@click.option(
    "--name",
    help="Name of this learner on the network and in the log.  [default: the host's; with --connect and --keys that of "
    "the key]",
)
@keys_option
@click.option(
    "--run",
    type=click.Path(path_type=Path),
    default=Path("runs/default"),
    show_default=True,
    help="Folder of the run; one of the same configuration is resumed. Its last part is the run's name.",
)
@run_options
@click.option(
    "--scenes",
    type=click.IntRange(len(ROOM_SCENES), len(SCENES)),
    default=len(ROOM_SCENES),
    show_default=True,
    help=f"How many scenes the scene layer tells apart: {len(ROOM_SCENES)}, or {len(SCENES)} with apartments.",
)
@click.option(
    "--config",
    "config_file",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="The whole configuration of the run as JSON, as run folders hold it, instead of the options that make it up.",
)
@click.option("--minutes", type=float, help="Budget of training time, minutes.  [default: none, until stopped]")
@click.option("--frames", type=int, help="Budget of environment frames.  [default: none, until stopped]")
@shared_memory_option
@click.option(
    "--checkpoint-seconds",
    type=click.FloatRange(min=1.0),
    default=30.0,
    show_default=True,
    help="Time between checkpoints, seconds; what a killed learner loses at most.",
)
@keep_every_option
@click.option(
    "--replay",
    type=click.Path(path_type=Path),
    help="The updates folder of a run: apply exactly these updates, in this order.  [default: as gradients arrive]",
)
@cache_option
@click.option(
    "--exit-when-done", is_flag=True, help="Exit when the budget is used up.  [default: go on serving graphs]"
)
@click.option("--quiet", is_flag=True, help="Print warnings only.  [default: a line every 5 s]")
def learner_command(
    listen: str | None,
    connect: str | None,
    name: str | None,
    keys: Path | None,
    run: Path,
    config_file: Path | None,
    checkpoint_seconds: float,
    keep_every: int | None,
    replay: Path | None,
    cache: Path | None,
    *,
    standby: bool,
    shared_memory: bool,
    exit_when_done: bool,
    quiet: bool,
    **choices: Any,
) -> None:
    """Apply the gradients of actors, merge their room graphs, and serve parameters, graphs and plans.

    Actors may come and go. SIGINT and SIGTERM stop the learner after a last checkpoint; the same command goes on from
    it. Two learners with --standby, the same router and the same run folder take turns when one of them fails.
    """
    import logging

    # Before the imports that take seconds: these say what is wrong with the options.
    if connect is None:
        if standby:
            message = "--standby needs --connect: a learner that listens is a router, and goes when it fails."
            raise InvalidValueError(message)
        listen = listen or (DEFAULT_ENDPOINT if keys is None else DEFAULT_ENCRYPTED_ENDPOINT)
    elif listen is not None:
        message = "--listen and --connect exclude each other: a learner is a router, or connects to one."
        raise InvalidValueError(message)
    credentials, name = _identity(keys, name, role="router" if connect is None else "learner")
    config = run_config(choices) if config_file is None else _config_in(config_file)

    from hoz_dist.policy.threads import use_one_thread
    from learner.service import LearnerSettings, serve

    use_one_thread()
    settings = LearnerSettings(
        listen=listen,
        connect=connect,
        credentials=credentials,
        name=name,
        standby=standby,
        run=run,
        config=config,
        shared_memory=shared_memory,
        checkpoint_seconds=checkpoint_seconds,
        keep_every=keep_every,
        replay=replay,
        rooms=_rooms(config, choices["weights"], cache) if config.learn_from == "rollouts" else None,
        exit_when_done=exit_when_done,
    )
    console = logging.StreamHandler()
    console.setLevel(logging.WARNING if quiet else logging.INFO)
    console.setFormatter(logging.Formatter("%(asctime)s %(message)s", datefmt="%H:%M:%S"))
    logging.basicConfig(level=logging.INFO, handlers=[console])
    stop = stop_on_signals()
    serve(settings, stop)


def _config_in(file: Path) -> "RunConfig":
    """Read a configuration.

    Raises:
        InvalidValueError: The file is not JSON, or a field is missing, unknown or out of range.
        UnknownNameError: A value of a field with named values does not exist.
        OSError: It cannot be read.
    """
    import json

    from hoz_dist.config import RunConfig

    try:
        values = json.loads(file.read_bytes())
    except ValueError as error:
        message = f"'{file}' is not JSON ({error}); give the config.json of a run folder."
        raise InvalidValueError(message) from error
    return RunConfig.from_json(values)


def _rooms(config: "RunConfig", weights: Path | None, cache: Path | None) -> "RoomSource":
    """Return where the learner sees what actors saw."""
    from hoz_dist.cli.rendering import Encoding, render_rooms
    from hoz_dist.evaluation.loading import matching_encoder
    from hoz_dist.sim.view_store import ViewStore, default_cache
    from learner.rooms import RoomSource

    folder, size, encoding = cache or default_cache(), config.picture_size, Encoding(config.encoder, weights)
    return RoomSource(
        ViewStore(folder, size),
        matching_encoder(config, weights),
        render=lambda room: render_rooms([room], folder, size, 1, encoding),
    )


def _identity(keys: Path | None, name: str | None, role: str) -> "tuple[Credentials | None, str]":
    """Return the keys and the name of this learner.

    Args:
        keys: Folder of keys; None for none.
        name: Name that was asked for.
        role: Role that the keys must be of.

    Raises:
        HozError: The keys cannot be used, or the name cannot, or is not that of the key.
    """
    from hoz_dist.wire.membership.liveliness import host_name
    from hoz_dist.wire.protocol.keys import check_name

    if keys is None:
        return None, check_name("learner", name or host_name())
    from hoz_dist.wire.transport.credentials import load_credentials

    credentials = load_credentials(keys, [role])
    if role != "learner":
        return credentials, check_name("learner", name or host_name())
    return credentials, credentials.own_name(name)
