from hoz_dist.cli.options import DEFAULT_PICTURE_SIZE
from hoz_dist.config import RunConfig


def test_rooms_are_rendered_at_the_size_that_runs_use() -> None:
    assert RunConfig().picture_size == DEFAULT_PICTURE_SIZE
