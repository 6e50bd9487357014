import pytest

from hoz_dist.wire.client import epochs
from hoz_dist.wire.client.epochs import AnotherRunError, Epochs, of_highest_epoch
from hoz_dist.wire.protocol.answers import Accepted, Busy, PushReply, Refused


def test_of_several_answers_the_one_of_the_highest_epoch_counts() -> None:
    new = Refused("epoch", "computed in epoch 1", 2)
    told: list[PushReply] = [Accepted(1, 9), new, Busy(1)]
    assert of_highest_epoch(told) is new
    assert Epochs().choose(told) is new
    assert of_highest_epoch(told[:0]) is None


def test_what_a_learner_of_a_lower_epoch_says_does_not_count() -> None:
    known = Epochs()
    known.hear(2)
    known.hear(1)
    assert known.highest == 2
    assert known.choose([Accepted(1, 5)]) is None
    assert known.choose([]) is None
    assert known.choose([Accepted(1, 5), new := Accepted(2, 1)]) is new
    assert known.choose([Busy(3)]) is not None
    assert known.choose([Accepted(2, 1)]) is None, "it never falls"


def test_a_lower_epoch_that_stays_the_only_one_is_another_run(monkeypatch: pytest.MonkeyPatch) -> None:
    known = Epochs()
    known.hear(4)
    assert known.choose([Accepted(1, 5)]) is None
    assert known.choose([Accepted(4, 5)]) is not None, "the old learner had been asleep, and stopped"
    assert known.choose([Accepted(1, 5)]) is None
    monkeypatch.setattr(epochs, "ANOTHER_RUN_S", 0.0)
    with pytest.raises(AnotherRunError, match=r"it is in epoch 1 and was in 4; start this process again\.$"):
        known.choose([Accepted(1, 5)])
