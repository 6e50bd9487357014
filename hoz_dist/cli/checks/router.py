"""Check of a router: who answers there, and how fast."""

import statistics
import time
from typing import Final

from hoz_dist.cli.checks.finding import Finding
from hoz_dist.client import HozClient
from hoz_dist.errors import HozError
from hoz_dist.wire.transport.credentials import Credentials

_QUESTIONS: Final = 5


def check_router(endpoint: str, credentials: Credentials | None = None) -> Finding:
    """Ask the learner behind an endpoint how it is, a few times.

    Args:
        endpoint: For example ``tcp/127.0.0.1:7447``.
        credentials: Who asks; None at a router without keys.
    """
    try:
        with HozClient(endpoint, credentials=credentials) as client:
            runs = client.runs()
        if not runs:
            advice = "Start one: hoz-dist learner."
            if credentials is not None:
                advice += " If one runs, give the router its newest router.json5, and start it again."
            return Finding("router", "warn", f"{endpoint} answers, but no learner", advice)
        answers = [_learner(endpoint, run, credentials) for run in runs]
    except HozError as error:
        return Finding("router", "fail", str(error).rstrip("."))
    return Finding("router", "ok", "; ".join(answers))


def _learner(endpoint: str, run: str, credentials: Credentials | None) -> str:
    """Say who takes part in a run, and how fast its learner answers."""
    times = []
    with HozClient(endpoint, run, credentials) as client:
        for _ in range(_QUESTIONS):
            start = time.perf_counter()
            status = client.status()
            times.append((time.perf_counter() - start) * 1000)
    roles = [process["role"] for process in status["processes"]]
    actors = roles.count("actor")
    return (
        f"run {run} at version {status['version']} with {actors} actor{'s' * (actors != 1)} "
        f"answers in {statistics.median(times):.1f} ms"
    )
