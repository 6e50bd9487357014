"""Options of the commands that connect to a learner."""

from pathlib import Path

import click

from hoz_dist.wire.endpoint import DEFAULT_ENDPOINT

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
