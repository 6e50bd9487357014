"""Finding the run to join or to ask."""

import threading
from collections import Counter

from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.wire.ask import ask
from hoz_dist.wire.codec import decode
from hoz_dist.wire.keys import ALL_CONFIGS, Keys
from hoz_dist.wire.messages import ConfigReply
from hoz_dist.wire.rejection import RejectedError
from hoz_dist.wire.session import Session
from hoz_dist.wire.waiting import Backoff, Deadline

FIND_S = 2.0
"""How long to look for a learner; it may be starting, or its router may not know it yet."""


def find_runs(session: Session, timeout_s: float = FIND_S, stop: threading.Event | None = None) -> list[ConfigReply]:
    """Return the configuration of every run whose learner answers now, sorted by the run's name.

    Learners that speak another protocol version are left out.

    Raises:
        RejectedError: Only such learners answer.
        StoppedError: The stop event was set.
    """
    return _configs(session, ALL_CONFIGS, timeout_s, stop)


def find_run(
    session: Session, run: str | None, timeout_s: float = FIND_S, stop: threading.Event | None = None
) -> ConfigReply:
    """Return the configuration of a run; asks again and again while no learner answers.

    Args:
        session: Session to look on.
        run: Name of the run; None for the only one that there is.
        timeout_s: How long to look.
        stop: Ends the search early.

    Raises:
        InvalidValueError: There are several runs and none was named, two learners serve the run, or the name cannot be
            one.
        NotFoundError: No learner of the run answers.
        RejectedError: The learner that answers speaks another protocol version.
        StoppedError: The stop event was set.
    """
    selector = ALL_CONFIGS if run is None else Keys(run).config
    deadline, backoff = Deadline(timeout_s), Backoff(stop or threading.Event())
    while True:
        found = _configs(session, selector, min(timeout_s, FIND_S), stop)
        if found:
            return _only(found)
        if deadline.passed:
            raise NotFoundError(_not_found(session, run))
        backoff.pause(deadline)


def _configs(session: Session, selector: str, timeout_s: float, stop: threading.Event | None) -> list[ConfigReply]:
    """Return the answers that can be read, sorted by run; see `find_runs`."""
    configs: list[ConfigReply] = []
    rejected: RejectedError | None = None
    for answer in ask(session, selector, timeout_s=timeout_s, stop=stop):
        try:
            configs.append(decode(answer.payload, ConfigReply))
        except RejectedError as error:
            rejected = error
    if rejected is not None and not configs:
        raise rejected
    return sorted(configs, key=lambda config: config.run)


def _only(found: list[ConfigReply]) -> ConfigReply:
    """Return the only run that was found.

    Raises:
        InvalidValueError: It is not the only one, or it has two learners.
    """
    learners = Counter(config.run for config in found)
    if len(learners) > 1:
        message = f"There are several runs: {', '.join(learners)}; choose one with --run."
        raise InvalidValueError(message)
    if len(found) > 1:
        message = f"{len(found)} learners serve a run named '{found[0].run}'; stop all but one of them."
        raise InvalidValueError(message)
    return found[0]


def _not_found(session: Session, run: str | None) -> str:
    if run is None:
        return "The router answers, but no learner: start one with `hoz-dist learner --listen ...`, or wait for it."
    others = [config.run for config in find_runs(session)]
    if others:
        return f"No learner of the run '{run}' answers; there are: {', '.join(others)}."
    return f"No learner of the run '{run}' answers, nor of any other run."
