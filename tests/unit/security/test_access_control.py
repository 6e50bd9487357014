"""The rules as a whole; tests/integration/security shows what real routers make of them."""

from datetime import UTC, datetime
from typing import Any

import pytest

from hoz_dist.security.access_control import access_control
from hoz_dist.security.register import Identity

EVERYBODY = [
    Identity(role, name, "1", datetime(2030, 1, 1, tzinfo=UTC))
    for role, names in {
        "actor": ("a0", "a1"),
        "learner": ("l0", "l1"),
        "router": ("r0",),
        "viewer": ("v0",),
    }.items()
    for name in names
]
PUSHED = ("/grads/", "/rollouts/", "/rooms/", "/alive/")


def rules_of(subject: str, identities: list[Identity] = EVERYBODY) -> list[dict[str, Any]]:
    """Return the rules that apply to one subject."""
    control = access_control(identities)
    names = {name for policy in control["policies"] if subject in policy["subjects"] for name in policy["rules"]}
    return [rule for rule in control["rules"] if rule["id"] in names]


def allowed(subject: str, flow: str, message: str) -> set[str]:
    return {
        key
        for rule in rules_of(subject)
        if flow in rule["flows"] and message in rule["messages"]
        for key in rule["key_exprs"]
    }


def test_what_is_not_allowed_is_denied() -> None:
    control = access_control(EVERYBODY)
    assert control["enabled"] is True
    assert control["default_permission"] == "deny"
    assert {rule["permission"] for rule in control["rules"]} == {"allow"}


def test_without_anybody_everything_is_denied() -> None:
    assert access_control([]) == {
        "enabled": True,
        "default_permission": "deny",
        "rules": [],
        "subjects": [],
        "policies": [],
    }


def test_a_subject_is_known_by_its_certificate() -> None:
    assert access_control(EVERYBODY[:1])["subjects"] == [{"id": "actor-a0", "cert_common_names": ["actor-a0"]}]


def test_names_are_unique_and_refer_to_what_there_is() -> None:
    control = access_control(EVERYBODY)
    rules, subjects = ([one["id"] for one in control[part]] for part in ("rules", "subjects"))
    assert len(set(rules)) == len(rules)
    assert len(set(subjects)) == len(subjects)
    for policy in control["policies"]:
        # Zenoh refuses a policy without either.
        assert set(policy["rules"]) <= set(rules)
        assert policy["rules"]
        assert set(policy["subjects"]) <= set(subjects)
        assert policy["subjects"]


def test_every_rule_is_about_runs() -> None:
    for rule in access_control(EVERYBODY)["rules"]:
        assert all(key.startswith("hoz/*/") and not key.startswith("hoz/*/*") for key in rule["key_exprs"])


def test_an_actor_speaks_under_its_own_name_only() -> None:
    sent = allowed("actor-a0", "ingress", "query") | allowed("actor-a0", "ingress", "liveliness_token")
    assert {key for key in sent if any(part in key for part in PUSHED)} == {
        "hoz/*/grads/a0",
        "hoz/*/rollouts/a0",
        "hoz/*/rooms/a0/*/*",
        "hoz/*/alive/actor/a0/*/*",
    }
    for message in ("put", "delete", "reply", "declare_queryable"):
        assert not allowed("actor-a0", "ingress", message)


def test_a_viewer_only_asks() -> None:
    assert [(rule["flows"], rule["messages"]) for rule in rules_of("viewer-v0")] == [
        (["ingress"], ["query"]),
        (["egress"], ["reply"]),
    ]
    questions = {"hoz/*/config", "hoz/*/status", "hoz/*/graphs/**", "hoz/*/plan/*"}
    assert allowed("viewer-v0", "ingress", "query") == questions


def test_a_learner_pushes_nothing_and_lives_under_its_own_name() -> None:
    assert not [key for key in allowed("learner-l0", "ingress", "query") if any(part in key for part in PUSHED)]
    own = {key for key in allowed("learner-l0", "ingress", "liveliness_token") if "@adv" not in key}
    assert own == {"hoz/*/alive/learner/l0/*/*", "hoz/*/alive/standby/l0/*/*"}


@pytest.mark.parametrize("subject", ["router-r0", "viewer-unknown"])
def test_a_router_and_the_unknown_may_nothing(subject: str) -> None:
    assert rules_of(subject) == []
