"""The model's bounds are those of the wire."""

from hoz_dist.config import RunConfig
from hoz_dist.scaling import node
from hoz_dist.scaling.setting import Setting
from hoz_dist.wire.serving import inbox, versions


def test_bounds_are_the_wires() -> None:
    assert node.MOST_WAITING == inbox.MOST_WAITING
    assert node.MOST_WAITING_BYTES == inbox.MOST_WAITING_BYTES
    assert node.LONGEST_WAIT_S == inbox.LONGEST_WAIT_S
    assert node.MOST_READERS == versions.MOST_READERS
    assert node.MOST_VERSION_BYTES == versions.MOST_BYTES
    assert Setting(actors=1).max_lag == RunConfig().max_lag
