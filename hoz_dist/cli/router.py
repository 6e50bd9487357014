"""`hoz-dist router`: the meeting place of learners, actors and queries, where no zenohd is installed."""

from pathlib import Path

import click

from hoz_dist.cli.connecting import credentials_in, keys_option, shared_memory_option
from hoz_dist.cli.stopping import stop_on_signals
from hoz_dist.errors import InvalidValueError
from hoz_dist.wire.transport.endpoint import DEFAULT_ENCRYPTED_ENDPOINT, DEFAULT_ENDPOINT


@click.command("router")
@click.option(
    "--listen",
    multiple=True,
    metavar="ENDPOINT",
    help="Endpoint to listen at, protocol/host:port; may be repeated.  "
    f"[default: {DEFAULT_ENDPOINT}, with --keys {DEFAULT_ENCRYPTED_ENDPOINT}]",
)
@keys_option
@shared_memory_option
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Configuration of a Zenoh router, JSON5, such as router.json5 of a key folder; instead of the other options.",
)
def router_command(*, listen: tuple[str, ...], keys: Path | None, shared_memory: bool, config: Path | None) -> None:
    """Run a router until it is stopped by SIGINT or SIGTERM.

    A Zenoh router of another making, `zenohd --config FILE`, does the same.
    """
    from hoz_dist.wire.transport.session import open_configured_router, open_router
    from hoz_dist.wire.transport.shared_memory import SharedMemory

    if config is not None and (listen or keys is not None or shared_memory):
        message = "--config says everything: leave out the other options, or leave out --config."
        raise InvalidValueError(message)
    credentials = credentials_in(keys, ["router"])
    stop = stop_on_signals()
    endpoints = listen or (DEFAULT_ENDPOINT if keys is None else DEFAULT_ENCRYPTED_ENDPOINT,)
    if config is not None:
        session = open_configured_router(config)
    else:
        session = open_router(endpoints, credentials, shared_memory=SharedMemory(on=shared_memory).on)
    with session:
        click.echo(f"Listening at {', '.join(endpoints) if config is None else f'the endpoints in {config}'}.")
        stop.wait()
