import numpy as np
import pytest

from hoz_dist.wire.protocol.parameters import Parameters, head_of
from hoz_dist.wire.serving.versions import EXPIRES_S, YIELDS_S, Versions

SIZE = 1000
BYTES = 4 * SIZE


def version(number: int) -> Parameters:
    vector = np.full(SIZE, number, np.float32)
    return Parameters(head_of(1, number, vector), vector)


def test_a_reader_keeps_the_version_that_it_began_with() -> None:
    versions = Versions()
    with pytest.raises(LookupError):
        versions.begin("slow", 0.0)
    versions.newest = first = version(1)
    assert versions.begin("slow", 0.0) is first
    for number in range(2, 50):
        versions.newest = version(number)
    assert versions.go_on("slow", (1, 1), 1.0) is first
    assert versions.kept_bytes() == 2 * BYTES, "the versions in between are not kept"
    versions.end("slow")
    assert versions.kept_bytes() == BYTES
    assert versions.go_on("slow", (1, 1), 2.0) is None
    assert versions.go_on("slow", (1, 49), 2.0) is versions.newest


def test_readers_of_one_version_share_it_and_one_that_begins_again_lets_go_of_it() -> None:
    versions = Versions()
    versions.newest = version(1)
    for reader in range(100):
        versions.begin(f"r{reader}", 0.0)
    versions.newest = version(2)
    assert versions.kept_bytes() == 2 * BYTES
    for reader in range(100):
        versions.begin(f"r{reader}", 1.0)
    assert versions.kept_bytes() == BYTES


def test_a_reader_that_asks_for_nothing_more_is_forgotten() -> None:
    versions = Versions()
    versions.newest = version(1)
    versions.begin("dead", 0.0)
    versions.newest = version(2)
    versions.begin("other", EXPIRES_S - 1)
    assert versions.go_on("dead", (1, 1), EXPIRES_S - 1) is not None
    versions.newest = version(3)
    versions.begin("third", 2 * EXPIRES_S)
    assert versions.go_on("dead", (1, 1), 2 * EXPIRES_S) is None
    assert versions.kept_bytes() == BYTES


def test_memory_is_bounded_and_those_who_read_on_are_never_cut_off() -> None:
    versions = Versions(most_bytes=3 * BYTES)
    for number in range(1, 4):
        versions.newest = version(number)
        assert versions.begin(f"r{number}", 0.0) is not None
    versions.newest = version(4)
    assert versions.kept_bytes() == 4 * BYTES
    assert versions.begin("late", 1.0) is None, "there is no room: ask again"
    for number in (2, 3):
        assert versions.go_on(f"r{number}", (1, number), YIELDS_S) is not None
    assert versions.begin("late", YIELDS_S) is versions.newest, "the one that had stopped made room"
    assert versions.go_on("r1", (1, 1), YIELDS_S) is None
    assert versions.go_on("r2", (1, 2), YIELDS_S) is not None


def test_the_number_of_readers_is_bounded() -> None:
    versions = Versions(most_readers=2)
    versions.newest = version(1)
    assert versions.begin("a", 0.0) is not None
    assert versions.begin("b", 0.0) is not None
    assert versions.begin("c", 0.0) is None
    versions.end("a")
    assert versions.begin("c", 0.0) is not None
