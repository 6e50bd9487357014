"""Fields that a message may lack: peers that do not know them are understood."""

import pytest

from hoz_dist.wire.protocol.codec import decode, encode
from hoz_dist.wire.protocol.pushes import EpisodesPush
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from tests import wire_samples as samples
from tests.mutations import joined, split

REPORT = EpisodesPush("a0", 77, 3, episodes=(samples.EPISODE,), policy_loss=-0.5, approach_loss=0.5)
FIELDS = split(encode(REPORT))[0]


def test_what_is_none_does_not_travel() -> None:
    assert FIELDS["approach_loss"] == 0.5
    assert "imitation_loss" not in FIELDS


def test_a_message_without_them_is_understood() -> None:
    told = decode(joined({name: FIELDS[name] for name in FIELDS if name != "approach_loss"}, b""), EpisodesPush)
    assert (told.policy_loss, told.imitation_loss, told.approach_loss) == (-0.5, None, None)


@pytest.mark.parametrize(
    ("value", "reason"), [(None, Reason.TYPE), ("0.5", Reason.TYPE), (float("nan"), Reason.NONFINITE)]
)
def test_what_travels_is_checked_and_nothing_is_no_value(value: object, reason: Reason) -> None:
    with pytest.raises(RejectedError) as refusal:
        decode(joined(FIELDS | {"approach_loss": value}, b""), EpisodesPush)
    assert refusal.value.reason == reason


def test_other_fields_are_still_needed() -> None:
    with pytest.raises(RejectedError, match="missing policy_loss"):
        decode(joined({name: FIELDS[name] for name in FIELDS if name != "policy_loss"}, b""), EpisodesPush)
