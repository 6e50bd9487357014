"""Finding the run to join or to ask."""

import threading

from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.waiting import Backoff, Deadline
from hoz_dist.wire.protocol.keys import ALL_CONFIGS, Keys
from hoz_dist.wire.protocol.run_messages import ConfigReply
from hoz_dist.wire.transport.ask import ask, messages_in
from hoz_dist.wire.transport.session import Session

FIND_S = 2.0
"""How long to look for a learner; it may be starting, or its router may not know it yet."""


def find_runs(session: Session, timeout_s: float = FIND_S, stop: threading.Event | None = None) -> list[ConfigReply]:
    """Return the configuration of every run whose learner answers now, sorted by the run's name.

    Learners that speak another protocol version are left out. Of two learners of a run the one of the higher epoch
    counts: the other one was replaced, and does not know it yet.

    Raises:
        RejectedError: Only learners answer that cannot be understood; an `OtherVersionError` says so.
        StoppedError: The stop event was set.
    """
    return _newest(_configs(session, ALL_CONFIGS, timeout_s, stop))


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
        InvalidValueError: There are several runs and none was named, two learners of one epoch serve the run, or the
            name cannot be one.
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
    """Return the answers that can be read and are on the key of their run; see `find_runs`."""
    answers = ask(session, selector, timeout_s=timeout_s, stop=stop)
    keys = {answer.key for answer in answers}
    return [config for config in messages_in(answers, ConfigReply) if Keys(config.run).config in keys]


def _newest(found: list[ConfigReply]) -> list[ConfigReply]:
    """Return the configuration of the highest epoch of each run, sorted by run."""
    newest = {config.run: config for config in sorted(found, key=lambda config: (config.run, config.epoch))}
    return list(newest.values())


def _only(found: list[ConfigReply]) -> ConfigReply:
    """Return the only run that was found.

    Raises:
        InvalidValueError: It is not the only one, or two learners of it are in one epoch.
    """
    newest, *others = _newest(found)
    if others:
        message = (
            f"There are several runs: {', '.join(config.run for config in (newest, *others))}; choose one with --run."
        )
        raise InvalidValueError(message)
    learners = sum(config.epoch == newest.epoch for config in found)
    if learners > 1:
        message = f"{learners} learners serve a run named '{newest.run}'; stop all but one of them."
        raise InvalidValueError(message)
    return newest


def _not_found(session: Session, run: str | None) -> str:
    if run is None:
        return (
            "The router answers, but no learner: start one with `hoz-dist learner --listen ...`, wait for it, or check "
            "that your key, if you have one, was not withdrawn."
        )
    others = [config.run for config in find_runs(session)]
    if others:
        return f"No learner of the run '{run}' answers; there are: {', '.join(others)}."
    return f"No learner of the run '{run}' answers, nor of any other run that your key, if you have one, may ask for."
