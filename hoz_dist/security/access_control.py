"""Access control: what each role may do at a router, as Zenoh's rules. What no rule allows is denied.

A rule speaks of messages that come in from a client (``ingress``) or go out to it (``egress``). The runs are not told
apart: all key expressions begin with ``hoz/*``.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple

from hoz_dist.security.register import Identity
from hoz_dist.wire.transport.credentials import common_name

_RUN: Final = "hoz/*"
_IN, _OUT = "ingress", "egress"


class _Allow(NamedTuple):
    """Messages that may pass on some keys."""

    flow: str
    messages: tuple[str, ...]
    keys: tuple[str, ...]


def access_control(identities: Iterable[Identity]) -> dict[str, Any]:
    """Return the access control of a router, as Zenoh's configuration has it.

    Args:
        identities: Everybody who has a key.
    """
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    everybody = list(identities)
    for role, permissions in _OF_ROLE.items():
        subjects = [common_name(one.role, one.name) for one in everybody if one.role == role]
        if subjects and permissions:
            policies.append({"rules": _add(rules, f"every-{role}", permissions), "subjects": subjects})
    for one in everybody:
        if own := _own(one):
            subject = common_name(one.role, one.name)
            policies.append({"rules": _add(rules, subject, own), "subjects": [subject]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [
            {"id": subject, "cert_common_names": [subject]}
            for subject in (common_name(one.role, one.name) for one in everybody)
        ],
        "policies": policies,
    }


def _add(rules: list[dict[str, Any]], name: str, permissions: Iterable[_Allow]) -> list[str]:
    """Add rules and return their names."""
    added = []
    for number, one in enumerate(permissions):
        added.append(f"{name}-{number}")
        rules.append(
            {
                "id": added[-1],
                "permission": "allow",
                "flows": [one.flow],
                "messages": list(one.messages),
                "key_exprs": list(one.keys),
            }
        )
    return added


def _of_run(*parts: str) -> tuple[str, ...]:
    return tuple(f"{_RUN}/{part}" for part in parts)


def _advanced(keys: tuple[str, ...]) -> tuple[str, ...]:
    """Return where Zenoh's advanced publishers of some keys are announced, beat, and keep their last sample.

    A chunk that begins with ``@`` is matched by itself alone, so that these are not among ``hoz/**``.
    """
    return tuple(f"{key}/@adv/pub/**" for key in keys)


def _last_samples(keys: tuple[str, ...]) -> tuple[str, ...]:
    """Return what advanced subscribers ask: they do not say ``pub``, but leave open what stands there."""
    return tuple(f"{key}/@adv/**" for key in keys)


def _asks(*parts: str) -> tuple[_Allow, ...]:
    """Allow to send queries, with or without payload, and to get the answers."""
    keys = _of_run(*parts)
    return (_Allow(_IN, ("query",), keys), _Allow(_OUT, ("reply",), keys))


def _serves(*parts: str) -> tuple[_Allow, ...]:
    """Allow to get queries and to answer them."""
    keys = _of_run(*parts)
    return (_Allow(_IN, ("declare_queryable", "reply"), keys), _Allow(_OUT, ("query",), keys))


def _follows(*parts: str) -> tuple[_Allow, ...]:
    """Allow to subscribe to what advanced publishers say, and to ask them for their last sample."""
    keys = _of_run(*parts)
    advanced = _advanced(keys)
    return (
        _Allow(_IN, ("declare_subscriber",), keys + advanced),
        _Allow(_IN, ("query",), _last_samples(keys)),
        _Allow(_IN, ("declare_liveliness_subscriber",), advanced),
        _Allow(_OUT, ("put",), keys + advanced),
        _Allow(_OUT, ("reply",), keys),
        _Allow(_OUT, ("liveliness_token",), advanced),
    )


def _publishes(*parts: str) -> tuple[_Allow, ...]:
    """Allow to be an advanced publisher."""
    keys = _of_run(*parts)
    advanced = _advanced(keys)
    return (
        _Allow(_IN, ("put",), keys + advanced),
        _Allow(_IN, ("reply",), keys),
        _Allow(_IN, ("declare_queryable", "liveliness_token"), advanced),
        _Allow(_OUT, ("declare_subscriber",), keys + advanced),
        _Allow(_OUT, ("query",), _last_samples(keys)),
        _Allow(_OUT, ("declare_liveliness_subscriber",), advanced),
    )


def _lives(*parts: str) -> tuple[_Allow, ...]:
    """Allow to declare liveliness tokens."""
    return (_Allow(_IN, ("liveliness_token",), _of_run(*parts)),)


def _watches(*parts: str) -> tuple[_Allow, ...]:
    """Allow to follow liveliness tokens."""
    keys = _of_run(*parts)
    return (_Allow(_IN, ("declare_liveliness_subscriber",), keys), _Allow(_OUT, ("liveliness_token",), keys))


_QUESTIONS: Final = ("config", "status", "graphs/**", "plan/*")
_PUSHES: Final = ("grads/*", "rollouts/*", "rooms/*/*/*")
_OF_ROLE: Final[Mapping[str, tuple[_Allow, ...]]] = {
    "router": (),
    "learner": (
        *_serves(*_QUESTIONS, "params/**", *_PUSHES),
        *_publishes("params", "graphs/*", "graphs/*/*"),
        *_watches("alive/*/*/*/*"),
        *_asks(*_QUESTIONS),
    ),
    "actor": (*_asks(*_QUESTIONS, "params/**"), *_follows("params", "graphs/*")),
    "viewer": _asks(*_QUESTIONS),
}


def _own(identity: Identity) -> tuple[_Allow, ...]:
    """Return what one may do under its own name only."""
    name = identity.name
    match identity.role:
        case "actor":
            return (
                *_asks(f"grads/{name}", f"rollouts/{name}", f"rooms/{name}/*/*"),
                *_lives(f"alive/actor/{name}/*/*"),
            )
        case "learner":
            return _lives(f"alive/learner/{name}/*/*", f"alive/standby/{name}/*/*")
        case _:
            return ()
