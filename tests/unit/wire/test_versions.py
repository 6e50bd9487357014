import numpy as np
import pytest

from hoz_dist.wire.protocol.message import SHARD_ELEMENTS
from hoz_dist.wire.protocol.parameters import ParametersHead
from hoz_dist.wire.serving.editions import Full
from hoz_dist.wire.serving.versions import EXPIRES_S, HELD_S, YIELDS_S, Versions

SHARDS = 100
BYTES = 4000


def version(number: int) -> Full:
    """A version that says that it has many shards, though the vector is short."""
    return Full(ParametersHead(1, number, SHARDS * SHARD_ELEMENTS), np.full(BYTES // 4, number, np.float32))


def begin(versions: Versions, reader: str, now: float) -> bool:
    """Begin to read the newest version."""
    assert versions.newest is not None
    return versions.begin(reader, versions.newest, now)


def test_a_reader_keeps_the_version_that_it_began_with() -> None:
    versions = Versions()
    versions.newest = first = version(1)
    assert begin(versions, "slow", 0.0)
    for number in range(2, 50):
        versions.newest = version(number)
    assert versions.go_on("slow", (1, 1), 1, 1.0) is first
    assert versions.kept_bytes() == 2 * BYTES, "the versions in between are not kept"
    assert versions.go_on("other", (1, 1), 2, 2.0) is None
    assert versions.go_on("other", (1, 49), 2, 2.0) is versions.newest


def test_readers_of_one_version_share_it_and_one_that_begins_again_lets_go_of_it() -> None:
    versions = Versions()
    versions.newest = version(1)
    for reader in range(100):
        begin(versions, f"r{reader}", 0.0)
    versions.newest = version(2)
    assert versions.kept_bytes() == 2 * BYTES
    for reader in range(100):
        begin(versions, f"r{reader}", 1.0)
    assert versions.kept_bytes() == BYTES


def test_a_reader_that_asks_for_nothing_more_is_forgotten() -> None:
    versions = Versions()
    versions.newest = version(1)
    begin(versions, "dead", 0.0)
    versions.newest = version(2)
    begin(versions, "other", EXPIRES_S - 1)
    assert versions.go_on("dead", (1, 1), 1, EXPIRES_S - 1) is not None
    versions.newest = version(3)
    begin(versions, "third", 2 * EXPIRES_S)
    assert versions.go_on("dead", (1, 1), 2, 2 * EXPIRES_S) is None
    assert versions.kept_bytes() == BYTES


def test_memory_is_bounded_and_those_who_get_on_are_not_cut_off_at_once() -> None:
    versions = Versions(most_bytes=3 * BYTES)
    for number in range(1, 4):
        versions.newest = version(number)
        assert begin(versions, f"r{number}", 0.0)
    versions.newest = version(4)
    assert versions.kept_bytes() == 4 * BYTES
    assert not begin(versions, "late", 1.0), "there is no room: ask again"
    for number in (2, 3):
        assert versions.go_on(f"r{number}", (1, number), 1, YIELDS_S) is not None
    assert begin(versions, "late", YIELDS_S), "the one that had stopped made room"
    assert versions.go_on("r1", (1, 1), 1, YIELDS_S) is None
    assert versions.go_on("r2", (1, 2), 2, YIELDS_S) is not None


def test_the_number_of_readers_is_bounded() -> None:
    versions = Versions(most_readers=2)
    versions.newest = version(1)
    assert begin(versions, "a", 0.0)
    assert begin(versions, "b", 0.0)
    assert not begin(versions, "c", 0.0)
    assert versions.go_on("a", (1, 1), SHARDS - 1, 0.0) is not None
    assert begin(versions, "c", 0.0)


@pytest.mark.parametrize("shard", [0, 1, SHARDS, 2**60])
def test_asking_for_the_same_shard_or_for_one_that_there_is_not_is_not_getting_on(shard: int) -> None:
    versions = Versions(most_bytes=2 * BYTES)
    for number in (1, 2):
        versions.newest = version(number)
        begin(versions, f"r{number}", 0.0)
        assert versions.go_on(f"r{number}", (1, number), 1, 0.0) is not None
    versions.newest = version(3)
    for second in range(1, int(YIELDS_S)):
        for number in (1, 2):
            assert versions.go_on(f"r{number}", (1, number), shard, second) is not None, "it is answered"
        assert not begin(versions, "late", second)
    assert begin(versions, "late", YIELDS_S)


def test_nobody_is_kept_out_for_ever_by_those_who_get_on_slowly() -> None:
    versions = Versions(most_bytes=3 * BYTES)
    for number in range(1, 4):
        versions.newest = version(number)
        assert begin(versions, f"r{number}", float(number))
    versions.newest = version(4)
    for second in range(4, int(HELD_S) + 1):
        for number in range(1, 4):
            assert versions.go_on(f"r{number}", (1, number), second, second) is not None
        assert not begin(versions, "late", second)
    assert begin(versions, "late", HELD_S + 1)
    assert versions.go_on("r1", (1, 1), 62, HELD_S + 1) is None, "the one that took longest begins again"
    for number in (2, 3):
        assert versions.go_on(f"r{number}", (1, number), 62, HELD_S + 1) is not None, "the others go on"
    assert versions.kept_bytes() == 3 * BYTES


def test_a_slow_reader_goes_on_for_as_long_as_there_is_room() -> None:
    versions = Versions(most_bytes=3 * BYTES)
    versions.newest = first = version(1)
    begin(versions, "slow", 0.0)
    for shard in range(1, SHARDS):
        versions.newest = version(1 + shard)
        begin(versions, "fast", 60.0 * shard)
        assert versions.go_on("slow", (1, 1), shard, 60.0 * shard) is first
        versions.go_on("fast", (1, 1 + shard), SHARDS - 1, 60.0 * shard)


def test_readers_without_end_make_room_as_well() -> None:
    versions = Versions(most_readers=2)
    versions.newest = version(1)
    for reader in ("a", "b"):
        begin(versions, reader, 0.0)
    for second in range(1, int(HELD_S)):
        for reader in ("a", "b"):
            versions.go_on(reader, (1, 1), second, second)
        assert not begin(versions, "c", second)
    assert begin(versions, "c", HELD_S)
    assert versions.go_on("a", (1, 1), 61, HELD_S) is not None, "it is the newest all the same"


def test_who_begins_again_and_again_does_not_keep_the_others_out() -> None:
    versions = Versions(most_bytes=2 * BYTES)
    for number in (1, 2):
        versions.newest = version(number)
        begin(versions, f"r{number}", 0.0)
    versions.newest = version(3)
    assert not begin(versions, "late", 1.0)
    assert not begin(versions, "r1", 1.0), "its own version does not make room for it alone"
    assert begin(versions, "late", 1.0)


def test_what_is_kept_for_other_reasons_counts_as_well() -> None:
    versions = Versions(most_bytes=2 * BYTES)
    versions.newest = version(1)
    versions.besides = (versions.newest, version(0), version(0))
    assert versions.kept_bytes() == 3 * BYTES
    assert not begin(versions, "a", 0.0)


def test_the_newest_version_is_no_substitute_for_what_a_delta_made() -> None:
    versions = Versions()
    versions.newest = version(1)
    made = version(1)
    assert versions.begin("a", made, 0.0)
    assert versions.go_on("a", (1, 1), 1, 0.0, deltas=True) is made
    assert versions.go_on("b", (1, 1), 1, 0.0) is versions.newest
    assert versions.go_on("b", (1, 1), 1, 0.0, deltas=True) is None


def test_a_shard_that_was_lost_can_be_asked_for_after_the_last_one_until_the_reader_begins_anew() -> None:
    versions = Versions()
    versions.newest = first = version(1)
    begin(versions, "a", 0.0)
    versions.newest = version(2)
    assert versions.go_on("a", (1, 1), SHARDS - 1, 1.0) is first
    assert versions.go_on("a", (1, 1), SHARDS - 2, 2.0) is first
    begin(versions, "a", 3.0)
    assert versions.go_on("a", (1, 1), SHARDS - 2, 3.0) is None
    assert versions.kept_bytes() == BYTES


def test_those_who_have_read_all_make_room_at_once_and_the_others_go_on() -> None:
    versions = Versions(most_bytes=3 * BYTES)
    for number in range(1, 4):
        versions.newest = version(number)
        begin(versions, f"r{number}", 0.0)
    assert versions.go_on("r2", (1, 2), SHARDS - 1, 0.0) is not None
    versions.newest = version(4)
    assert begin(versions, "late", 0.0)
    assert versions.go_on("r2", (1, 2), SHARDS - 1, 0.0) is None
    for number in (1, 3):
        assert versions.go_on(f"r{number}", (1, number), 1, 0.0) is not None


def test_readers_of_what_is_kept_anyway_are_not_forgotten_to_make_room() -> None:
    versions = Versions(most_bytes=2 * BYTES)
    base = version(0)
    versions.newest = version(1)
    versions.besides = (base,)
    versions.begin("first", base, 0.0)
    begin(versions, "second", 1.0)
    versions.newest = version(2)
    for second in range(2, int(HELD_S) + 1):
        for reader, number in (("first", 0), ("second", 1)):
            assert versions.go_on(reader, (1, number), second, second) is not None
    assert begin(versions, "late", HELD_S + 1)
    assert versions.go_on("first", (1, 0), 70, HELD_S + 1) is base, "to forget it would have freed nothing"
    assert versions.go_on("second", (1, 1), 70, HELD_S + 1) is None
