import numpy as np
import pytest

from hoz_dist.wire.client.download import Download
from hoz_dist.wire.protocol.message import SHARD_ELEMENTS
from hoz_dist.wire.protocol.parameters import ParametersHead, ParametersShard, head_of
from hoz_dist.wire.protocol.rejection import Reason, RejectedError

VECTOR = np.arange(2 * SHARD_ELEMENTS + 5, dtype=np.float32)
HEAD = head_of(1, 7, VECTOR)


def shard(number: int, head: ParametersHead = HEAD) -> ParametersShard:
    start = number * SHARD_ELEMENTS
    return ParametersShard(head, number, VECTOR[start : start + SHARD_ELEMENTS])


def test_shards_in_order_become_the_vector() -> None:
    download = Download()
    for number in range(3):
        assert download.result() is None
        assert download.next == number
        assert download.add(shard(number))
    parameters = download.result()
    assert parameters is not None
    assert parameters.head.stamp == (1, 7)
    np.testing.assert_array_equal(parameters.vector, VECTOR)
    assert not parameters.vector.flags.writeable


def test_shards_of_other_versions_or_out_of_order_are_not_taken() -> None:
    download = Download()
    assert not download.add(shard(1))
    assert download.add(shard(0))
    assert not download.add(shard(0))
    assert not download.add(shard(2))
    assert not download.add(shard(1, ParametersHead(1, 8, HEAD.digest, HEAD.size, HEAD.shards)))
    assert not download.add(shard(1, ParametersHead(1, 7, "0" * 16, HEAD.size, HEAD.shards)))
    assert download.add(shard(1))
    download.begin_again()
    assert download.next == 0
    assert download.add(shard(0))


def test_a_vector_without_the_digest_of_its_head_is_rejected() -> None:
    download = Download()
    wrong = ParametersHead(1, 7, "0" * 16, HEAD.size, HEAD.shards)
    for number in range(3):
        assert download.add(shard(number, wrong))
    with pytest.raises(RejectedError) as caught:
        download.result()
    assert caught.value.reason == Reason.DIGEST
