"""Finding the run to join or to ask."""

import threading

from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.wire.ask import ask
from hoz_dist.wire.codec import decode
from hoz_dist.wire.keys import ALL_CONFIGS, Keys
from hoz_dist.wire.messages import ConfigReply
from hoz_dist.wire.session import Session
from hoz_dist.wire.waiting import Backoff, Deadline

FIND_S = 2.0
"""How long to look for a learner; it may be starting, or its router may not know it yet."""


def find_runs(session: Session, timeout_s: float = FIND_S) -> list[ConfigReply]:
    """Return the configuration of every run whose learner answers now, sorted by the run's name.

    Raises:
        RejectedError: A learner answers that speaks another protocol version.
    """
    answers = ask(session, ALL_CONFIGS, timeout_s=timeout_s)
    return sorted((decode(answer.payload, ConfigReply) for answer in answers), key=lambda config: config.run)


def find_run(session: Session, run: str | None, timeout_s: float = FIND_S) -> ConfigReply:
    """Return the configuration of a run.

    Args:
        session: Session to look on.
        run: Name of the run; None for the only one that there is.
        timeout_s: How long to look.

    Raises:
        InvalidValueError: There are several runs and none was named, or the name cannot be one.
        NotFoundError: No learner of the run answers.
        RejectedError: A learner answers that speaks another protocol version.
    """
    if run is not None:
        Keys(run)
    deadline, backoff = Deadline(timeout_s), Backoff(threading.Event())
    while True:
        runs = find_runs(session, timeout_s)
        found = [config for config in runs if run in {None, config.run}]
        if len(found) == 1:
            return found[0]
        if len(found) > 1:
            names = ", ".join(config.run for config in found)
            message = f"There are several runs: {names}; choose one with --run."
            raise InvalidValueError(message)
        if deadline.passed:
            raise NotFoundError(_not_found(run, [config.run for config in runs]))
        backoff.pause(deadline)


def _not_found(run: str | None, others: list[str]) -> str:
    if run is None:
        return "The router answers, but no learner: start one with `hoz-dist learner --connect ...`, or wait for it."
    if others:
        return f"No learner of the run '{run}' answers; there are: {', '.join(others)}."
    return f"No learner of the run '{run}' answers, nor of any other run."
