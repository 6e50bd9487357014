"""`hoz-dist status`: asks a learner who takes part and how it goes."""

from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from hoz_dist.cli.connecting import READERS, connect_option, credentials_in, keys_option, run_option
from hoz_dist.cli.options import echo_json, json_option

if TYPE_CHECKING:
    from hoz_dist.client import HozClient

EVERY_S: Final = 2.0
"""Time between two renewals by default, seconds."""


@click.command("status")
@connect_option
@keys_option
@run_option
@click.option("--watch", is_flag=True, help="Renew until Ctrl-C: in place on a terminal, a line each time elsewhere.")
@click.option(
    "--every",
    type=click.FloatRange(min=0.1),
    metavar="SECONDS",
    help=f"Time between two renewals of --watch.  [default: {EVERY_S:g}]",
)
@json_option
def status_command(
    *, connect: str, keys: Path | None, run: str | None, watch: bool, every: float | None, as_json: bool
) -> None:
    """Show the live processes of a run, who left, the version of its parameters, and what was rejected.

    With --watch it goes on while the learner or the router is away, and says so.
    """
    from hoz_dist.client import HozClient

    if every is not None and not watch:
        message = "--every is the time between two renewals: it needs --watch."
        raise click.UsageError(message)

    credentials = credentials_in(keys, READERS)

    def open_client() -> HozClient:
        return HozClient(connect, run, credentials)

    if watch:
        # Ctrl-C is how one ends it, and nothing went wrong.
        with suppress(KeyboardInterrupt):
            _watch(open_client, every or EVERY_S, as_json=as_json)
        return
    with open_client() as client:
        status = client.status()
    if as_json:
        echo_json(status)
        return
    from hoz_dist.cli.consoles import result_console
    from hoz_dist.cli.status_text import status_page

    result_console(markup=False).print(status_page(status))


def _watch(open_client: "Callable[[], HozClient]", every: float, *, as_json: bool) -> None:
    from hoz_dist.cli.consoles import result_console
    from hoz_dist.cli.watching import Page, Watcher, print_json, print_line, watch

    console = result_console(markup=False)
    with ExitStack() as stack:
        watcher = stack.enter_context(Watcher(open_client))
        if as_json:
            show = print_json
        elif console.is_terminal:
            show = stack.enter_context(Page(console)).show
        else:
            show = print_line
        watch(watcher, show, every)
