"""Queryables that are drained by a thread of their own, and how a query is answered."""

import contextlib
from collections.abc import Callable
from typing import Final

import zenoh
from zenoh import Query, Session, ZBytes
from zenoh.handlers import FifoChannel

from hoz_dist.errors import HozError, NotFoundError, UnknownNameError
from hoz_dist.wire.protocol.answers import Busy, Refused
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.keys import NOBODY
from hoz_dist.wire.protocol.message import Message
from hoz_dist.wire.protocol.rejection import Reason, RejectedError, plain
from hoz_dist.wire.protocol.rejections import Rejections
from hoz_dist.wire.transport.draining import Drain

LONGEST_QUESTION: Final = 4096
"""Characters of a question's key and parameters; the longest that makes sense names all categories."""
_NOT_COUNTED: Final = frozenset({Reason.NOT_FOUND, Reason.GONE})
"""Reasons for which nobody is to blame."""
_CHANNEL: Final = 16
"""Queries that Zenoh holds while the thread is busy with the one before; more of them block the sender's transport."""


def answer(query: Query, key: str, message: Message) -> None:
    """Answer a query with one message and let go of it.

    Args:
        query: The query.
        key: Concrete key of what the message tells.
        message: ``busy`` and ``refused`` travel as error replies, for which the key does not matter.
    """
    payload = encode(message)
    if not isinstance(message, Busy | Refused):
        reply(query, key, payload)
        return
    with query:
        query.reply_err(payload)


def reply(query: Query, key: str, payload: bytes | ZBytes, checksum: bytes | None = None) -> None:
    """Answer a query with an encoded message and let go of it.

    Args:
        query: The query.
        key: Concrete key of what the message tells.
        payload: The message, neither ``busy`` nor ``refused``.
        checksum: Its checksum, if that is to go along.
    """
    with query:
        query.reply(key, payload, attachment=checksum)


def check_question(query: Query) -> None:
    """Judge the length of a question.

    Raises:
        RejectedError: It is too long to be looked at.
    """
    if len(str(query.selector)) > LONGEST_QUESTION:
        raise RejectedError(Reason.SIZE, f"the question is longer than {LONGEST_QUESTION} characters")


def refuse(query: Query, error: HozError, epoch: int, rejections: Rejections) -> None:
    """Say in one sentence what is wrong with a question, and count it if somebody is to blame."""
    refusal = refusal_of(error, epoch)
    if refusal.reason not in _NOT_COUNTED:
        rejections.count(Reason(refusal.reason), refusal.detail, NOBODY)
    answer(query, "", refusal)


def parameters_of(query: Query) -> dict[str, str]:
    """Return the parameters of a question, ``?name=value;name=value``, by name."""
    named = (part.partition("=") for part in str(query.parameters).split(";"))
    return {name: value for name, _, value in named}


def refusal_of(error: HozError, epoch: int) -> Refused:
    """Return the refusal that makes the asking side raise the same error; see `error_of`."""
    match error:
        case UnknownNameError():
            reason = Reason.NAME
        case NotFoundError():
            reason = Reason.NOT_FOUND
        case RejectedError():
            reason = error.reason
        case _:
            reason = Reason.MALFORMED
    return Refused(reason.value, plain(str(error)), epoch)


def declare_queryable(
    session: Session,
    key_expr: str,
    handle: Callable[[Query], None],
    epoch: int = 0,
    rejections: Rejections | None = None,
) -> Drain[Query]:
    """Answer the queries on some keys in a thread.

    Args:
        session: Session to declare it on.
        key_expr: Keys that it answers for.
        handle: Answers a query, or keeps it to be answered later. Should it raise, the query is refused.
        epoch: Epoch of the learner, for that refusal.
        rejections: Where that refusal is counted; None for nowhere.
    """

    def handle_or_refuse(query: Query) -> None:
        try:
            handle(query)
        except Exception:
            detail = "the learner failed to answer; its log says why"
            if rejections is not None:
                rejections.count(Reason.INTERNAL, detail, NOBODY)
            with contextlib.suppress(zenoh.ZError):  # it may have been answered already
                answer(query, "", Refused(Reason.INTERNAL.value, detail, epoch))
            raise

    return Drain(session.declare_queryable(key_expr, FifoChannel(_CHANNEL)), handle_or_refuse, f"answers {key_expr}")
