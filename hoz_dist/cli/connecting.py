"""Options of the commands that connect to a learner."""

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from hoz_dist.wire.transport.endpoint import DEFAULT_ENDPOINT

if TYPE_CHECKING:
    from hoz_dist.wire.transport.credentials import Credentials

READERS: Final = ("viewer", "actor", "learner")
"""Roles that may ask questions."""

connect_option = click.option(
    "--connect",
    metavar="ENDPOINT",
    default=DEFAULT_ENDPOINT,
    show_default=True,
    help="Endpoint of the learner or of a router.",
)
run_option = click.option("--run", metavar="NAME", help="Name of the run.  [default: the only one that is found]")
keys_option = click.option(
    "--keys",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Folder with the keys of this process, made by `hoz-dist keys`.  [default: none, for tcp/ endpoints]",
)
shared_memory_option = click.option(
    "--shared-memory/--no-shared-memory",
    default=False,
    show_default=True,
    help="Hand over large messages on one host through shared memory; learner, actors and router must all have it on.",
)


def credentials_in(keys: Path | None, roles: Collection[str]) -> "Credentials | None":
    """Read the key folder that the user named; None when there is none.

    Args:
        keys: The folder.
        roles: Roles that are fit for the command.

    Raises:
        HozError: The folder cannot be used.
    """
    if keys is None:
        return None
    from hoz_dist.wire.transport.credentials import load_credentials

    return load_credentials(keys, roles)
