"""`hoz-dist doctor`: does this machine have what hoz-dist needs?"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hoz_dist.cli.checks.finding import Finding
from hoz_dist.cli.connecting import READERS, credentials_in, keys_option
from hoz_dist.cli.options import cache_option, echo_json, json_option

if TYPE_CHECKING:
    from hoz_dist.wire.transport.credentials import Credentials

_COLOURS = {"ok": "green", "warn": "yellow", "fail": "red"}


@click.command("doctor")
@cache_option
@click.option(
    "--connect",
    metavar="ENDPOINT",
    help="Also check a router, for example tcp/127.0.0.1:7447.  [default: none is checked]",
)
@keys_option
@json_option
def doctor_command(cache: Path | None, connect: str | None, keys: Path | None, *, as_json: bool) -> int:
    """Check this machine, the view cache and, with --connect, the router.

    One line for each check: ok, warn or fail, and what to do. The exit status is 1 when a check fails.
    """
    if keys is not None and connect is None:
        message = "--keys are shown to the router that is checked: they need --connect."
        raise click.UsageError(message)
    credentials = credentials_in(keys, READERS)
    findings = []
    for finding in _findings(cache, connect, credentials):
        findings.append(finding)
        if not as_json:
            click.echo(f"{click.style(f'{finding.state:4}', fg=_COLOURS[finding.state])}  {finding.sentence}")
    if as_json:
        echo_json({"checks": [finding._asdict() for finding in findings]})
    return int(any(finding.state == "fail" for finding in findings))


def _findings(cache: Path | None, endpoint: str | None, credentials: "Credentials | None") -> Iterator[Finding]:
    """Run the checks one after another."""
    from hoz_dist.cli.checks.machine import check_cores, check_memory, check_packages, check_python, check_shared_memory

    yield check_python()
    yield from check_packages()
    yield check_cores()
    yield check_memory()
    yield check_shared_memory()

    try:
        from hoz_dist.cli.checks.simulator import check_cache, check_damage, check_rendering
    except ImportError as error:
        yield Finding("rendering", "fail", f"the simulator cannot be imported: {error}", "Install what is missing.")
    else:
        yield check_rendering()
        yield check_cache(cache)
        yield check_damage(cache)

    if endpoint is not None:
        from hoz_dist.cli.checks.router import check_router

        yield check_router(endpoint, credentials)
