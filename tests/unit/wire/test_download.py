import numpy as np
import pytest

from hoz_dist.wire.client.download import Base, Download, base_of
from hoz_dist.wire.protocol.message import SHARD_ELEMENTS
from hoz_dist.wire.protocol.parameters import (
    Parameters,
    ParametersDelta,
    ParametersHead,
    ParametersShard,
    Part,
    digest_of,
)
from hoz_dist.wire.protocol.rejection import RejectedError
from hoz_dist.wire.serving.bases import Bases
from hoz_dist.wire.serving.editions import Delta, Edition, Full
from hoz_dist.wire.transport.buffers import Buffers

VECTOR = np.arange(4 * SHARD_ELEMENTS + 5, dtype=np.float32)
HEAD = ParametersHead(1, 7, VECTOR.size)
FULL = Full(HEAD, VECTOR)
OLD = Full(ParametersHead(1, 5, VECTOR.size), VECTOR + 1)
BASE = base_of(Parameters(OLD.head, OLD.vector))


@pytest.fixture
def delta() -> Delta:
    bases = Bases(Buffers())
    bases.publish(OLD)
    bases.next_for("none")
    bases.publish(FULL)
    edition = bases.next_for(BASE.digest)
    assert isinstance(edition, Delta)
    return edition


def downloaded(edition: Edition, base: Base | None = None) -> Parameters:
    download = Download(Buffers(), base)
    for number in range(edition.shards):
        assert download.result() is None
        assert download.next == number
        assert download.add(edition.part(number))
    assert download.shards == edition.shards
    parameters = download.result()
    assert parameters is not None
    return parameters


def test_shards_in_order_become_the_vector() -> None:
    parameters = downloaded(FULL)
    assert parameters.head.stamp == (1, 7)
    np.testing.assert_array_equal(parameters.vector, VECTOR)
    assert not parameters.vector.flags.writeable


def test_deltas_in_order_become_the_vector(delta: Delta) -> None:
    assert delta.shards == 2
    parameters = downloaded(delta, BASE)
    assert parameters.head.stamp == (1, 7)
    np.testing.assert_allclose(parameters.vector, VECTOR, atol=1e-6)


def test_shards_of_other_versions_or_out_of_order_are_not_taken() -> None:
    download = Download(Buffers())
    assert not download.add(FULL.part(1))
    assert download.add(FULL.part(0))
    assert not download.add(FULL.part(0))
    assert not download.add(FULL.part(2))
    for head in (ParametersHead(1, 8, VECTOR.size), ParametersHead(2, 7, VECTOR.size)):
        assert not download.add(Full(head, VECTOR).part(1))
    longer = np.zeros(VECTOR.size + 1, np.float32)
    assert not download.add(Full(ParametersHead(1, 7, longer.size), longer).part(1))
    assert download.add(FULL.part(1))
    download.begin_again()
    assert download.next == 0
    assert download.add(FULL.part(0))


def test_deltas_to_another_base_are_not_taken(delta: Delta) -> None:
    shorter = Parameters(ParametersHead(1, 5, VECTOR.size - 1), OLD.vector[1:])
    for base in (None, Base(BASE.parameters, digest_of(VECTOR)), Base(shorter, BASE.digest)):
        assert not Download(Buffers(), base).add(delta.part(0))


def test_deltas_and_full_shards_are_not_mixed(delta: Delta) -> None:
    first: Part
    second: Part
    for first, second in ((delta.part(0), FULL.part(1)), (FULL.part(0), delta.part(1))):
        download = Download(Buffers(), BASE)
        assert download.add(first)
        assert not download.add(second)


@pytest.mark.parametrize("renews", [False, True])
def test_a_delta_says_whether_it_makes_a_base(renews: bool) -> None:
    head, small = ParametersHead(1, 6, 1), np.zeros(1, np.float32)
    download = Download(Buffers(), base_of(Parameters(head, small)))
    part = ParametersDelta(head, digest_of(small), renews, 0, np.full(1, 0.5, np.float32), np.full(1, 3, np.int8))
    assert download.add(part)
    assert download.renews == renews
    parameters = download.result()
    assert parameters is not None
    assert parameters.vector.tolist() == [1.5]


def test_what_comes_in_full_is_a_base() -> None:
    download = Download(Buffers(), BASE)
    assert download.add(FULL.part(0))
    assert download.renews


@pytest.mark.parametrize(("size", "shard"), [(VECTOR.size, 5), (VECTOR.size - 1, 4)])
def test_a_shard_that_its_version_does_not_have_cannot_be_made(size: int, shard: int) -> None:
    with pytest.raises(RejectedError, match="shard"):
        ParametersShard(ParametersHead(1, 7, size), shard, VECTOR[-5:])
