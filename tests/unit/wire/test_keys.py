import pytest
import zenoh

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.keys import ALL_CONFIGS, NAME_PATTERN, NOBODY, Keys, check_name, sender_of


def test_the_keys_are_those_of_the_protocol() -> None:
    keys = Keys("night-3")
    assert keys.config == "hoz/night-3/config"
    assert keys.params == "hoz/night-3/params"
    assert keys.shard(2) == "hoz/night-3/params/2"
    assert keys.grads("a0") == "hoz/night-3/grads/a0"
    assert keys.rollouts("a0") == "hoz/night-3/rollouts/a0"
    assert keys.room("a0", RoomId("kitchen", 3)) == "hoz/night-3/rooms/a0/kitchen/3"
    assert keys.graph("kitchen/3") == "hoz/night-3/graphs/kitchen/3"
    assert keys.plan("kitchen") == "hoz/night-3/plan/kitchen"
    assert keys.status == "hoz/night-3/status"
    assert keys.alive("actor", "a0", "h", 7) == "hoz/night-3/alive/actor/a0/h/7"


def test_wildcards_select_the_keys() -> None:
    keys = Keys("r")
    pairs = [
        (ALL_CONFIGS, keys.config),
        (keys.all_params, keys.params),
        (keys.all_params, keys.shard(0)),
        (keys.all_grads, keys.grads("a0")),
        (keys.all_rollouts, keys.rollouts("a0")),
        (keys.all_rooms, keys.room("a0", RoomId("kitchen", 3))),
        (keys.all_graphs, keys.graph("kitchen")),
        (keys.all_graphs, keys.graph("kitchen/3")),
        (keys.all_plans, keys.plan("bathroom")),
        (keys.all_alive, keys.alive("actor", "a0", "h", 7)),
    ]
    for selector, key in pairs:
        assert zenoh.KeyExpr(selector).includes(zenoh.KeyExpr(key)), (selector, key)


@pytest.mark.parametrize(
    "name", ["", "a/b", "*", "a**", "$*", "@v1", "a?b", "a#b", "-a", ".", "é", "a b", "x" * 65, "a\n"]
)
def test_names_that_would_change_the_meaning_of_a_key_are_refused(name: str) -> None:
    with pytest.raises(InvalidValueError, match="The run name"):
        Keys(name)
    with pytest.raises(InvalidValueError, match="The actor name"):
        check_name("actor", name)


def test_senders_are_named_by_keys_alone() -> None:
    keys = Keys("r")
    room = RoomId("kitchen", 3)
    assert [sender_of(key) for key in (keys.grads("a0"), keys.rollouts("a1"), keys.room("a2", room))] == [
        "a0",
        "a1",
        "a2",
    ]
    for strange in ("hoz/**", "hoz/r/grads", keys.all_grads, "hoz/r/grads/a b", f"hoz/r/grads/{'a' * 65}", ""):
        assert sender_of(strange) == NOBODY
    assert not NAME_PATTERN.fullmatch(NOBODY), "no actor can be called so"
