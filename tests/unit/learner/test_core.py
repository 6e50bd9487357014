"""The core as a pure state machine: what goes in, what comes out."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.config import Compression, RunConfig
from hoz_dist.errors import InvalidValueError
from hoz_dist.gradient_forms import Bf16Gradient, TopKGradient
from hoz_dist.nav.categories import TARGETS
from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.protocol.rejection import Reason
from learner.clock import LONGEST_GAP_S
from learner.core import GRAPH_CHECKPOINT_SECONDS, LearnerCore
from learner.events import (
    EpisodesReceived,
    Finish,
    GradientReceived,
    PublishGraph,
    PublishParameters,
    RecordUpdate,
    Reply,
    RoomGraphReceived,
    SaveCheckpoint,
    Tick,
)
from learner.replay import Schedule, UpdateRecord
from tests.unit.learner.making import (
    CONFIG,
    SIZE,
    Float32,
    answer,
    episodes,
    gradient,
    push,
    replies,
    room_graph,
    room_push,
    vector,
)


def new_core(config: RunConfig = CONFIG, **options: object) -> LearnerCore:
    return LearnerCore(config, vector(99), **options)  # type: ignore[arg-type]


def refused(core: LearnerCore, item: GradientPush) -> Refused:
    (reply,) = push(core, item)
    assert isinstance(reply, Refused)
    return reply


# --- gradients ---


def test_a_gradient_is_applied_published_recorded_and_acknowledged() -> None:
    core = new_core()
    before = core.parameters.copy()
    effects = core.handle(GradientReceived(7, gradient(0)), now=0.0)
    assert [type(effect) for effect in effects] == [RecordUpdate, PublishParameters, Reply]
    (reply,) = replies(effects)
    assert reply.request == 7
    assert isinstance(reply.answer, Accepted)
    assert (reply.answer.epoch, reply.answer.version) == (1, 1)
    assert effects[0] == RecordUpdate(UpdateRecord("a", 1, 0, 0, 0, CONFIG.learning_rate))
    assert (core.parameters != before).all()


def test_fresh_gradients_train_as_adam_does() -> None:
    core = new_core(replace(CONFIG, gradient_norm=1e6))
    reference = torch.from_numpy(vector(99)).requires_grad_()
    adam = torch.optim.Adam([reference], lr=CONFIG.learning_rate)
    for version in range(10):
        push(core, gradient(version, version=version))
        reference.grad = torch.from_numpy(vector(version))
        adam.step()
    np.testing.assert_allclose(core.parameters, reference.detach().numpy(), rtol=1e-6, atol=1e-7)


def test_lag_is_measured_and_a_stale_gradient_weighs_less() -> None:
    core = new_core(replace(CONFIG, gradient_norm=1e6))
    push(core, *(gradient(sequence, version=0) for sequence in range(4)))
    assert core.statistics.lag() == (0, 1.5, 3)
    # The last gradient, three versions old, entered the first moment with half its weight.
    expected = np.zeros(SIZE)
    for lag in range(4):
        expected = 0.9 * expected + 0.1 * vector(lag) / np.sqrt(1 + lag)
    np.testing.assert_allclose(core.snapshot(0.0).adam.first_moment, expected, rtol=1e-5, atol=1e-7)


def test_a_gradient_beyond_the_lag_bound_is_refused() -> None:
    core = new_core()
    bound = CONFIG.max_lag
    push(core, *(gradient(sequence, version=sequence) for sequence in range(bound + 1)))
    assert refused(core, gradient(90, version=0)).reason == Reason.STALE
    (reply,) = push(core, gradient(91, version=1))
    assert isinstance(reply, Accepted)


def of_norm(norm: float) -> Float32:
    direction = vector(0).astype(np.float64)
    return (direction * (norm / np.linalg.norm(direction))).astype(np.float32)


def spoilt(wrong: float) -> Float32:
    values = vector(0)
    values[-1] = wrong
    return values


def test_a_gradient_at_the_bound_of_its_norm_is_taken_with_its_rounding() -> None:
    core = new_core()
    (reply,) = push(core, gradient(0, values=of_norm(1.0001 * CONFIG.gradient_norm)))
    assert isinstance(reply, Accepted)


@pytest.mark.parametrize(
    ("item", "reason"),
    [
        (gradient(0, epoch=2), Reason.EPOCH),
        (gradient(0, epoch=4), Reason.EPOCH),
        (gradient(0, epoch=3, version=1), Reason.STALE),
        (gradient(0, epoch=3, values=vector(0, SIZE + 1)), Reason.SHAPE),
        (gradient(0, epoch=3, values=vector(0, SIZE - 1)), Reason.SHAPE),
        (gradient(0, epoch=3, values=of_norm(1.01 * CONFIG.gradient_norm)), Reason.NORM),
        (gradient(0, epoch=3, values=np.full(SIZE, 3e38, np.float32)), Reason.NORM),
        (gradient(0, epoch=3, values=spoilt(np.nan)), Reason.NONFINITE),
        (gradient(0, epoch=3, values=spoilt(-np.inf)), Reason.NONFINITE),
        (gradient(0, epoch=3, frames=CONFIG.batch * CONFIG.rollout_steps + 1), Reason.RANGE),
        (gradient(0, epoch=3, values=Bf16Gradient(np.zeros(SIZE, np.uint16))), Reason.CODEC),
    ],
    ids=[
        *("last epoch", "next epoch", "future version", "too long", "too short", "too large", "huge", "NaN"),
        *("infinite", "too many frames", "other codec"),
    ],
)
def test_a_gradient_that_does_not_fit_is_refused_and_changes_nothing(item: GradientPush, reason: Reason) -> None:
    core = new_core(epoch=3)
    before = core.parameters.copy()
    effects = core.handle(GradientReceived(0, item), now=0.0)
    assert [type(effect) for effect in effects] == [Reply]
    (reply,) = replies(effects)
    assert isinstance(reply.answer, Refused)
    assert reply.answer.reason == reason
    assert (core.version, core.statistics.frames) == (0, 0)
    np.testing.assert_array_equal(core.parameters, before)


@pytest.mark.parametrize("codec", ["bf16", "int8", "topk"])
def test_a_compressed_gradient_is_applied_as_what_it_stands_for(codec: Compression) -> None:
    core, plain = new_core(replace(CONFIG, compress=codec)), new_core()
    form = Compressor(codec, SIZE, CONFIG.gradient_norm).compress(vector(3), version=0)
    values = Decompressor(SIZE).decompress(form).vector
    push(core, gradient(0, values=form), gradient(1, values=form))  # the second one lags
    push(plain, gradient(0, values=values), gradient(1, values=values))
    np.testing.assert_array_equal(core.parameters, plain.parameters)
    assert core.version == 2


@pytest.mark.parametrize("bits", [0x7F80, 0xFFC0])
def test_a_compressed_gradient_that_is_not_finite_is_refused(bits: int) -> None:
    halves = np.full(SIZE, bits, np.uint16)
    assert refused(new_core(replace(CONFIG, compress="bf16")), gradient(0, values=Bf16Gradient(halves))).reason == (
        Reason.NONFINITE
    )
    largest = TopKGradient(SIZE, np.array([2], np.uint32), halves[:1])
    assert refused(new_core(replace(CONFIG, compress="topk")), gradient(0, values=largest)).reason == Reason.NONFINITE


def test_a_compressed_gradient_that_is_too_long_is_refused() -> None:
    core = new_core(replace(CONFIG, compress="topk"))
    form = TopKGradient(SIZE, np.array([2], np.uint32), np.array([0x4180], np.uint16))  # 16
    assert refused(core, gradient(0, values=form)).reason == Reason.NORM
    full = refused(core, gradient(0))
    assert (full.reason, full.detail) == (Reason.CODEC, "the gradient travels as fp32; the run's do as topk")


def test_a_repeated_gradient_is_acknowledged_again_and_not_applied() -> None:
    core = new_core()
    push(core, gradient(0))
    before = core.parameters.copy()
    effects = core.handle(GradientReceived(5, gradient(0)), now=0.0)
    (reply,) = replies(effects)
    assert isinstance(reply.answer, Accepted)
    assert not any(isinstance(effect, PublishParameters | RecordUpdate) for effect in effects)
    np.testing.assert_array_equal(core.parameters, before)
    assert (core.version, core.statistics.frames, core.statistics.duplicates) == (1, 10, 1)


def test_another_incarnation_is_another_sender() -> None:
    core = new_core()
    push(core, gradient(0), gradient(0, incarnation=2), gradient(0, actor="b"))
    assert core.version == 3


# --- episodes and room graphs ---


def test_episodes_are_counted_once_and_by_scene() -> None:
    core = new_core()
    item = episodes(0, ("kitchen/1", True), ("kitchen/2", False), ("bathroom/1", True))
    for _ in range(2):
        assert isinstance(answer(core, EpisodesReceived(0, item)), Accepted)
    success = core.status(0.0)["success"]
    assert success == {"episodes": 3, "overall": 2 / 3, "scenes": {"bathroom": 1.0, "kitchen": 0.5}}
    assert core.status(0.0)["episodes"] == 3


def test_each_kind_of_push_is_numbered_apart() -> None:
    core = new_core()
    push(core, gradient(0))
    assert isinstance(answer(core, EpisodesReceived(0, episodes(0, ("kitchen/1", True)))), Accepted)
    assert core.statistics.episodes == 1


def test_a_new_room_graph_is_published_and_soon_saved() -> None:
    core = new_core()
    item = room_push(0, room_graph("kitchen/3"))
    effects = core.handle(RoomGraphReceived(0, item), now=10.0)
    assert [type(effect) for effect in effects] == [PublishGraph, Reply]
    assert effects[0] == PublishGraph(item.room)
    assert core.status(0.0)["scenes"] == {"kitchen": {"version": 1, "rooms": ["kitchen/3"]}}
    assert core.handle(Tick(), now=10.0 + GRAPH_CHECKPOINT_SECONDS) == [SaveCheckpoint(keep=False)]


def test_a_known_room_graph_is_acknowledged_and_changes_nothing() -> None:
    core = new_core()
    answer(core, RoomGraphReceived(0, room_push(0, room_graph("kitchen/3"))))
    effects = core.handle(RoomGraphReceived(0, room_push(1, room_graph("kitchen/3"))), now=0.0)
    assert [type(effect) for effect in effects] == [Reply]
    assert isinstance(replies(effects)[0].answer, Accepted)


def test_a_graph_of_another_content_of_a_room_is_refused_and_the_first_kept() -> None:
    core = new_core()
    first = room_graph("kitchen/3")
    answer(core, RoomGraphReceived(0, room_push(0, first)))
    reply = answer(core, RoomGraphReceived(0, room_push(1, room_graph("kitchen/3", seed=1, digest="another"))))
    assert isinstance(reply, Refused)
    assert reply.reason == Reason.DIGEST
    np.testing.assert_array_equal(core.graphs.rooms["kitchen/3"].nodes, first.nodes)


def test_a_room_graph_of_other_categories_is_refused() -> None:
    categories = (TARGETS[1], TARGETS[0], *TARGETS[2:])
    reply = answer(new_core(), RoomGraphReceived(0, room_push(0, room_graph("kitchen/3"), categories)))
    assert isinstance(reply, Refused)
    assert reply.reason == Reason.NAME


# --- the budget ---


def test_the_learning_rate_falls_with_the_frames_and_the_run_finishes() -> None:
    core = new_core(replace(CONFIG, frames=40))
    rates, finishes = [], 0
    for version in range(4):
        effects = core.handle(GradientReceived(version, gradient(version, version=version)), now=0.0)
        rates.append(core.learning_rate)
        finishes += sum(isinstance(effect, Finish) for effect in effects)
    assert rates == pytest.approx([0.01, 0.0075, 0.005, 0.0025])
    assert effects[-2:] == [SaveCheckpoint(keep=True), Finish()]
    assert finishes == 1
    assert core.status(0.0)["progress"] == 1.0
    before = core.parameters.copy()
    assert refused(core, gradient(4, version=4)).reason == Reason.FINISHED
    np.testing.assert_array_equal(core.parameters, before)
    assert isinstance(answer(core, EpisodesReceived(0, episodes(0, ("kitchen/1", True)))), Accepted)
    assert core.handle(Tick(), now=1.0) == []


def test_a_budget_of_minutes_counts_from_the_first_push() -> None:
    core = new_core(replace(CONFIG, minutes=1.0))
    assert core.handle(Tick(), now=1000.0) == []
    push(core, gradient(0), now=1000.0)
    push(core, gradient(1, version=1), now=1015.0)
    assert core.learning_rate == pytest.approx(0.0075)
    assert core.status(1015.0)["seconds_left"] == 45.0
    assert Finish() not in core.handle(Tick(), now=1059.0)
    assert Finish() in core.handle(Tick(), now=1060.0)


def test_time_without_actors_does_not_use_up_the_budget() -> None:
    core = new_core(replace(CONFIG, minutes=10.0))
    push(core, gradient(0), now=0.0)
    morning = 8 * 3600.0
    assert core.handle(Tick(), now=morning) == [SaveCheckpoint(keep=False)]
    push(core, gradient(1, version=1), now=morning)
    assert core.status(morning)["progress"] == LONGEST_GAP_S / 600.0
    assert core.learning_rate == pytest.approx(0.009)


def test_time_stands_still_after_the_end() -> None:
    core = new_core(replace(CONFIG, frames=10))
    push(core, gradient(0), now=0.0)
    push(core, gradient(1, version=1), now=5.0)
    answer(core, RoomGraphReceived(0, room_push(0, room_graph("kitchen/3"))), now=20.0)
    assert core.seconds(50.0) == 0.0


def test_without_a_budget_the_learning_rate_stays() -> None:
    core = new_core()
    push(core, gradient(0), now=0.0)
    push(core, gradient(1, version=1), now=1e6)
    assert core.learning_rate == CONFIG.learning_rate
    assert core.status(1e6)["progress"] is None


# --- checkpoints ---


def test_a_checkpoint_is_asked_for_at_intervals_when_something_changed() -> None:
    core = new_core(checkpoint_seconds=30.0)
    assert core.handle(Tick(), now=100.0) == []
    push(core, gradient(0), now=100.0)
    assert core.handle(Tick(), now=129.0) == []
    assert core.handle(Tick(), now=130.0) == [SaveCheckpoint(keep=False)]
    assert core.handle(Tick(), now=300.0) == []


def test_checkpoints_are_kept_at_milestones_of_frames_also_after_a_restart() -> None:
    core = new_core(keep_every=100)

    def kept_after(core: LearnerCore, sequence: int) -> bool:
        epoch = core.epoch
        effects = core.handle(
            GradientReceived(0, gradient(sequence, epoch=epoch, version=core.version, frames=40)), now=float(sequence)
        )
        return SaveCheckpoint(keep=True) in effects

    assert [kept_after(core, sequence) for sequence in range(6)] == [False, False, True, False, True, False]
    resumed = LearnerCore(CONFIG, vector(3), epoch=2, checkpoint=core.snapshot(now=6.0), keep_every=100)
    assert [kept_after(resumed, sequence) for sequence in range(6, 9)] == [False, True, False]


@pytest.mark.parametrize("budget", [{}, {"frames": 400}, {"minutes": 2.0}])
def test_a_resumed_run_continues_as_if_never_interrupted(budget: dict[str, float]) -> None:
    config = replace(CONFIG, **budget)  # type: ignore[arg-type]
    straight = new_core(config)
    answer(straight, RoomGraphReceived(0, room_push(0, room_graph("kitchen/1"))), now=0.0)
    for version in range(5):
        push(straight, gradient(version, version=version), now=float(version))
    resumed = LearnerCore(config, vector(3), epoch=2, checkpoint=straight.snapshot(now=4.0))
    assert resumed.version == 5
    # The restarted learner's clock is another one; its training time goes on from where it was saved.
    answer(resumed, EpisodesReceived(0, episodes(0, ("kitchen/1", True))), now=9000.0)
    answer(straight, EpisodesReceived(0, episodes(0, ("kitchen/1", True))), now=4.0)
    for version in range(5, 12):
        push(straight, gradient(version, version=version), now=float(version - 1))
        push(resumed, gradient(version, epoch=2, version=version), now=9000.0 + version - 5)
    np.testing.assert_array_equal(resumed.parameters, straight.parameters)
    then = resumed.status(9000.0 + 6.0), straight.status(10.0)
    for name in ("version", "frames", "episodes", "success", "scenes", "learning_rate", "progress"):
        assert then[0][name] == then[1][name], name


def test_what_was_saved_is_not_counted_again_after_a_restart() -> None:
    core = new_core()
    push(core, gradient(0))
    resumed = LearnerCore(CONFIG, vector(3), epoch=2, checkpoint=core.snapshot(0.0))
    (again,) = push(resumed, gradient(0, epoch=1))
    assert isinstance(again, Accepted)
    assert again.epoch == 2
    assert refused(resumed, gradient(1, epoch=1, version=1)).reason == Reason.EPOCH
    assert resumed.version == 1


def test_a_checkpoint_of_another_policy_is_refused() -> None:
    checkpoint = new_core().snapshot(0.0)
    with pytest.raises(InvalidValueError, match="11 parameters"):
        LearnerCore(CONFIG, vector(0, 12), checkpoint=checkpoint)


def test_a_snapshot_does_not_change_with_the_run() -> None:
    core = new_core()
    push(core, gradient(0))
    snapshot = core.snapshot(0.0)
    kept = snapshot.parameters.copy(), snapshot.adam.first_moment.copy()
    push(core, gradient(1, version=1))
    np.testing.assert_array_equal(snapshot.parameters, kept[0])
    np.testing.assert_array_equal(snapshot.adam.first_moment, kept[1])


# --- repeating a recorded run ---


def recorded(core: LearnerCore, *pushes: GradientPush) -> list[UpdateRecord]:
    records = []
    for request, item in enumerate(pushes):
        effects = core.handle(GradientReceived(request, item), now=float(request))
        records += [effect.record for effect in effects if isinstance(effect, RecordUpdate)]
    return records


def test_a_recorded_order_gives_identical_parameters() -> None:
    config = replace(CONFIG, minutes=1.0)  # so that the learning rate depends on the time
    order = [
        gradient(0, actor="a", version=0),
        gradient(0, actor="b", version=0),
        gradient(1, actor="b", version=0),
        gradient(1, actor="a", version=0),
    ]
    first = new_core(config)
    records = recorded(first, *order)
    second = new_core(config, schedule=Schedule(records))
    waiting = [replace(item, incarnation=9) for item in (order[2], order[3], order[1], order[0])]
    rounds = 0
    while waiting:
        rounds += 1
        waiting = [item for item in waiting if isinstance(push(second, item, now=7.0 * rounds)[0], Busy)]
    assert rounds > 1
    assert first.parameters.tobytes() == second.parameters.tobytes()
    assert second.finished
    assert second.status(0.0)["replay"] == {"applied": 4, "total": 4, "diverged": 0}


def test_nothing_is_computed_from_a_gradient_whose_turn_has_not_come(monkeypatch: pytest.MonkeyPatch) -> None:
    records = recorded(new_core(), gradient(0), gradient(1))
    core = new_core(schedule=Schedule(records))
    monkeypatch.setattr(Decompressor, "decompress", lambda *_: pytest.fail("it comes again and again"))
    (reply,) = push(core, gradient(1))
    assert isinstance(reply, Busy)


def test_an_actor_that_the_recorded_run_did_not_have_is_told_whom_it_had() -> None:
    records = recorded(new_core(), gradient(0, actor="anna"), gradient(0, actor="ben", version=1))
    refusal = refused(new_core(schedule=Schedule(records)), gradient(0, actor="carl"))
    assert refusal.reason == Reason.NAME
    assert "no actor 'carl'" in refusal.detail
    assert "--name for each of: anna, ben" in refusal.detail


def test_a_gradient_that_the_recorded_run_did_not_apply_is_refused() -> None:
    records = recorded(new_core(), gradient(0), gradient(2))
    core = new_core(schedule=Schedule(records))
    push(core, gradient(0))
    assert refused(core, gradient(1)).reason == Reason.STALE
    assert core.version == 1
