"""Questions that are too long, or ask for too much."""

import numpy as np
import pytest

from hoz_dist.wire.protocol.answers import Refused
from hoz_dist.wire.protocol.codec import decode
from hoz_dist.wire.serving import server as serving
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.transport.ask import ask
from hoz_dist.wire.transport.session import Session
from tests import wire_samples as samples
from tests.integration.wire.pushing import KEYS

pytestmark = pytest.mark.integration


def test_a_long_question_is_refused_whatever_it_asks_for(learner: Server, client: Session) -> None:
    learner.put_graph(samples.scene_graph())
    with ParametersPublisher(learner.session, KEYS, learner.rejections) as publisher:
        publisher.publish(1, 0, np.zeros(3, np.float32))
        keys = (KEYS.config, KEYS.status, KEYS.params, KEYS.shard(0), KEYS.graph("kitchen"), KEYS.graph("**"))
        for key in (*keys, KEYS.plan("kitchen")):
            (answer,) = ask(client, f"{key}?reader=r;long={'x' * 5000}", timeout_s=5.0)
            assert decode(answer.payload, Refused).reason == "size", key
    assert learner.rejections.by_reason() == {"size": 7}


def test_a_wildcard_gives_all_graphs_unless_they_are_too_much(
    learner: Server, client: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    learner.put_graph(samples.scene_graph())
    learner.put_graph(samples.room_graph())
    answers = ask(client, KEYS.graph("**"), timeout_s=5.0)
    assert {answer.key for answer in answers} == {KEYS.graph("kitchen"), KEYS.graph("kitchen/3")}
    monkeypatch.setattr(serving, "MOST_BYTES_OF_GRAPHS", len(answers[0].payload) + 100)
    (answer,) = ask(client, KEYS.graph("**"), timeout_s=5.0)
    refused = decode(answer.payload, Refused)
    assert refused.reason == "size"
    assert "ask scene by scene" in refused.detail
    (answer,) = ask(client, KEYS.graph("*"), timeout_s=5.0)
    assert answer.key == KEYS.graph("kitchen"), "scene by scene it is answered"
    assert learner.rejections.by_reason() == {"size": 1}
