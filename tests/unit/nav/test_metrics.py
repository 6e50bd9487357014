import pytest
from hypothesis import given
from hypothesis import strategies as st

from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.metrics import long_episodes, metrics_of, sae_of, spl_of
from hoz_dist.nav.rooms import RoomId


def result(
    *, success: bool = True, actions: int = 6, moves: int = 3, said_done: bool = True, optimal: int = 5
) -> EpisodeResult:
    return EpisodeResult(
        room=RoomId("kitchen", 21),
        target=0,
        success=success,
        actions=actions,
        moves=moves,
        said_done=said_done,
        optimal=optimal,
    )


def test_the_optimal_path_has_an_spl_of_one() -> None:
    # Five actions and Done: Done is not counted in L.
    assert spl_of(result(actions=6, optimal=5)) == 1.0


def test_spl_falls_with_the_actions_taken() -> None:
    assert spl_of(result(actions=11, optimal=5)) == pytest.approx(0.5)


def test_sae_is_the_share_of_moves_done_included() -> None:
    assert sae_of(result(actions=6, moves=3)) == pytest.approx(0.5)


def test_failure_counts_zero() -> None:
    failed = result(success=False, actions=100, said_done=False)
    assert spl_of(failed) == sae_of(failed) == 0.0


def test_metrics_average_over_every_episode() -> None:
    # By hand: SR 2/4; SPL (1 + 1/2) / 4; SAE (1/2 + 2/11) / 4.
    metrics = metrics_of(
        [
            result(actions=6, moves=3, optimal=5),
            result(actions=11, moves=2, optimal=5),
            result(success=False, actions=1),
            result(success=False, actions=100, said_done=False),
        ]
    )
    assert metrics.episodes == 4
    assert metrics.sr == pytest.approx(0.5)
    assert metrics.spl == pytest.approx(1.5 / 4)
    assert metrics.sae == pytest.approx((1 / 2 + 2 / 11) / 4)


def test_no_episodes_give_zeros() -> None:
    assert metrics_of([]) == (0, 0.0, 0.0, 0.0)


def test_long_episodes_have_an_optimal_path_of_five_or_more() -> None:
    results = [result(optimal=optimal) for optimal in (1, 4, 5, 6)]
    assert [kept.optimal for kept in long_episodes(results)] == [5, 6]


@given(
    actions=st.integers(1, 200),
    share=st.floats(0, 1),
    optimal=st.integers(1, 100),
    success=st.booleans(),
    said_done=st.booleans(),
)
def test_metrics_stay_between_zero_and_success(
    actions: int, share: float, optimal: int, success: bool, said_done: bool
) -> None:
    episode = result(success=success, actions=actions, moves=int(share * actions), said_done=said_done, optimal=optimal)
    assert 0.0 <= spl_of(episode) <= float(success)
    assert 0.0 <= sae_of(episode) <= float(success)
