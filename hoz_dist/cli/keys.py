"""`hoz-dist keys`: makes the keys that let processes in, and says what their holders may do."""

from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from hoz_dist.cli.options import echo_json, json_option
from hoz_dist.errors import InvalidValueError
from hoz_dist.wire.transport.endpoint import DEFAULT_ENCRYPTED_ENDPOINT, check_endpoint, is_encrypted

if TYPE_CHECKING:
    from hoz_dist.security.key_folders import RouterPlace
    from hoz_dist.security.register import Identity

_FOLDER: Final = Path("keys")
_DAYS: Final = 365
_MOST_DAYS: Final = 3650

authority_option = click.option(
    "--authority",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    default=_FOLDER,
    show_default=True,
    help="Folder of the authority, made by `hoz-dist keys init`.",
)


@click.group("keys")
def keys_group() -> None:
    """Make keys that let processes in, and say what they may do.

    First: hoz-dist keys init. Then, for everybody: hoz-dist keys issue ROLE NAME
    """


@keys_group.command("init")
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path), default=_FOLDER)
def init_command(folder: Path) -> None:
    """Make an authority in FOLDER, `keys` by default.

    Whoever has its private key, ca.key, can make keys: it stays on the machine of whoever issues them.
    """
    from hoz_dist.security.key_folders import AUTHORITY_KEY_FILE, create_authority

    create_authority(folder)
    click.echo(f"Made an authority in {folder}; never give {folder / AUTHORITY_KEY_FILE} away.")


@keys_group.command("issue")
@click.argument("role", metavar="ROLE")
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@authority_option
@click.option(
    "--days",
    type=click.IntRange(1, _MOST_DAYS),
    default=_DAYS,
    show_default=True,
    help="How long the keys are valid, days.",
)
@click.option(
    "--host",
    "hosts",
    multiple=True,
    metavar="HOST",
    help="Of a router: name or address that clients connect to; may be repeated.  "
    "[default: as before; always: localhost, 127.0.0.1]",
)
@click.option(
    "--listen",
    multiple=True,
    metavar="ENDPOINT",
    help="Of a router: endpoint in its router.json5; may be repeated.  "
    f"[default: as before, else {DEFAULT_ENCRYPTED_ENDPOINT}]",
)
@click.option(
    "--at",
    metavar="FOLDER",
    help="Of a router: where its key folder will be on its machine, /etc/hoz-dist/keys/router-main say.  "
    "[default: as before, else where it is made]",
)
@click.option(
    "--replace", is_flag=True, help="Issue a key anew; the old one stays valid until it expires. Default: refuse."
)
@json_option
def issue_command(
    *,
    role: str,
    names: tuple[str, ...],
    authority: Path,
    days: int,
    hosts: tuple[str, ...],
    listen: tuple[str, ...],
    at: str | None,
    replace: bool,
    as_json: bool,
) -> None:
    """Make a key folder for each NAME, who may do what a ROLE may: router, learner, actor or viewer.

    Carry each folder to the machine of its holder. The routers must get their router.json5 again and be started again,
    to know new names.

    Examples: hoz-dist keys issue router r0 --host router.lab.example

    hoz-dist keys issue actor a0 a1 a2
    """
    from hoz_dist.security.key_folders import issue_keys

    place = _place(role, hosts, listen, at)
    issued = issue_keys(authority, role, names, timedelta(days=days), place, replace=replace)
    if as_json:
        echo_json([_as_json(identity, folder) for identity, folder in issued])
        return
    for identity, folder in issued:
        click.echo(f"{folder}: {identity.role} {identity.name}, valid until {identity.expires:%Y-%m-%d}")
    click.echo(_ROUTERS)


@keys_group.command("withdraw")
@click.argument("role", metavar="ROLE")
@click.argument("name", metavar="NAME")
@authority_option
def withdraw_command(role: str, name: str, authority: Path) -> None:
    """Take away from the ROLE NAME all that its key allows, and delete the key folder here.

    The routers must get their router.json5 again and be started again. Issue that name no key again before the old one
    has expired: its holder would be let in.
    """
    from hoz_dist.security.key_folders import withdraw_key

    withdraw_key(authority, role, name)
    click.echo(f"Withdrew the key of the {role} {name}.")
    click.echo(_ROUTERS)


_ROUTERS: Final = "Give each router its router.json5 again and start it again: only then it knows."


def _place(role: str, hosts: tuple[str, ...], listen: tuple[str, ...], at: str | None) -> "RouterPlace | None":
    """Return where routers will be; None for another role.

    Raises:
        InvalidValueError: An endpoint is not one of a router with keys, or the options are given to another role.
    """
    from hoz_dist.security.key_folders import RouterPlace

    if role != "router":
        if hosts or listen or at is not None:
            message = f"--host, --listen and --at are for routers; leave them out for the role {role}."
            raise InvalidValueError(message)
        return None
    for endpoint in listen:
        if not is_encrypted(check_endpoint(endpoint)):
            message = f"'{endpoint}' is not encrypted, so that keys protect nothing there; write tls/host:port."
            raise InvalidValueError(message)
    return RouterPlace(hosts, listen, at)


def _as_json(identity: "Identity", folder: Path) -> dict[str, Any]:
    return {
        "role": identity.role,
        "name": identity.name,
        "folder": str(folder),
        "serial": identity.serial,
        "expires": identity.expires.isoformat(),
    }
