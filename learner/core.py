"""What the learner decides: events in, effects out. No input or output, no clock, no threads.

    core = LearnerCore(config, initial_parameters(config.policy, config.seed), epoch=1)
    for effect in core.handle(GradientReceived(request=7, push=push), now=time.monotonic()):
        ...  # carried out by `learner.serving`

Gradients are applied as they arrive; in a run that learns from rollouts, they are computed as those arrive. The
parameter version counts the updates; the lag of a push is how many versions the parameters went on since the version
that it was computed or acted on.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from hoz_dist.a3c.compression.decompressor import Decompressor
from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError
from hoz_dist.gradient_forms import Vector
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.parameters import check_fit
from hoz_dist.wire.protocol.answers import Accepted, Busy, Refused
from hoz_dist.wire.protocol.pushes import GradientPush, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.trajectories import TrajectoryPush
from learner.admission import Admission
from learner.checkpoint import Checkpoint
from learner.clock import TrainingClock
from learner.deduplication import SeenPushes, Sender
from learner.events import (
    Effect,
    EpisodesReceived,
    Event,
    Finish,
    GradientReceived,
    OpenRoom,
    PublishGraph,
    PublishParameters,
    RecordUpdate,
    Reply,
    RoomGraphReceived,
    RoomOpened,
    RoomUnusable,
    SaveCheckpoint,
    Tick,
    TrajectoryReceived,
)
from learner.graph_store import GraphStore
from learner.optimizer import NORM_TOLERANCE, FlatAdam, lag_weight
from learner.replay import Schedule, UpdateRecord
from learner.rollout_gradients import Learnt, RolloutGradients
from learner.statistics import Statistics

LOSS_TERMS: Final = ("policy_loss", "value_loss", "entropy", "scene_loss", "imitation_loss", "approach_loss")
"""Fields of `EpisodesPush` that are recorded for TensorBoard, where they are not None."""
GRAPH_CHECKPOINT_SECONDS: Final = 2.0
"""A new room graph is saved this soon: rooms are few, and each took an actor a whole exploration."""


class LearnerCore:
    """State of a run: parameters, graphs, counters.

    Args:
        config: The run's configuration.
        parameters: Initial parameters, float32 [P].
        epoch: Epoch of this learner.
        checkpoint: Where to go on from, instead of the initial parameters.
        room_digests: Digests of rooms that are known beforehand, by room name.
        schedule: Recorded updates to repeat.
        checkpoint_seconds: Time between checkpoints.
        keep_every: Frames between checkpoints that are never deleted; None for none but the last.
        rollouts: Computes the gradients of rollouts, if the run learns from them; made when None.

    Raises:
        InvalidValueError: The checkpoint's parameters do not fit the configuration's policy.
    """

    def __init__(
        self,
        config: RunConfig,
        parameters: Vector,
        *,
        epoch: int = 1,
        checkpoint: Checkpoint | None = None,
        room_digests: Mapping[str, str] | None = None,
        schedule: Schedule | None = None,
        checkpoint_seconds: float = 30.0,
        keep_every: int | None = None,
        rollouts: RolloutGradients | None = None,
    ) -> None:
        self.config = config
        self.epoch = epoch
        self.version = 0
        self.finished = False
        self._optimizer = FlatAdam(parameters, config.learning_rate)
        self._decompressor = Decompressor(self._optimizer.size)
        self.graphs = GraphStore(config.zones, room_digests or {}, merging=config.merging)
        self.statistics = Statistics()
        self._seen = SeenPushes()
        self._schedule = schedule
        self._checkpoint_seconds = checkpoint_seconds
        self._keep_every = keep_every
        self._checkpoint_due: float | None = None
        """When to save; None while nothing changed."""
        self._clock = TrainingClock()
        if checkpoint is not None:
            self._resume(checkpoint, room_digests or {})
        self._kept = self._milestone
        self._admission = Admission(config, epoch, self._optimizer.size, schedule)
        self._rollouts: RolloutGradients | None = None
        if config.learn_from == "rollouts":
            self._rollouts = rollouts or RolloutGradients(config)
            self._rollouts.begin(epoch, self._optimizer.tensor, self.graphs.scenes.values())

    # --- what the shell reads ---

    @property
    def parameters(self) -> Vector:
        """The parameters as they are now, [P]: a view that the next gradient changes."""
        return self._optimizer.parameters

    @property
    def learning_rate(self) -> float:
        """The learning rate of the last update."""
        return self._optimizer.learning_rate

    def seconds(self, now: float) -> float:
        """Return the training time so far, in all epochs: while gradients or room graphs came that counted."""
        return self._clock.seconds(now)

    def progress(self, now: float) -> float | None:
        """Return the share of the budget used, in [0, 1]; None without a budget."""
        if self.config.frames is not None:
            return min(self.statistics.frames / self.config.frames, 1.0)
        if self.config.minutes is not None:
            return min(self.seconds(now) / (60.0 * self.config.minutes), 1.0)
        return None

    def snapshot(self, now: float) -> Checkpoint:
        """Return a copy of all that a run needs to go on."""
        return Checkpoint(
            config=self.config,
            epoch=self.epoch,
            version=self.version,
            frames=self.statistics.frames,
            episodes=self.statistics.episodes,
            seconds=self.seconds(now),
            parameters=self._optimizer.parameters.copy(),
            adam=self._optimizer.state(),
            rooms=tuple(self.graphs.rooms.values()),
            graph_versions=dict(self.graphs.versions),
            recent=tuple(self.statistics.recent),
            seen=self._seen.rows(),
        )

    def status(self, now: float) -> dict[str, Any]:
        """Return what ``hoz-dist status`` shows, less the processes and rejections, as JSON values."""
        statistics, lag, progress = self.statistics, self.statistics.lag(), self.progress(now)
        return {
            "version": self.version,
            "epoch": self.epoch,
            "frames": statistics.frames,
            "episodes": statistics.episodes,
            "frames_per_second": round(statistics.frames_per_second(now), 1),
            "success": statistics.success(),
            "lag": {"min": lag.minimum, "mean": round(lag.mean, 2), "max": lag.maximum, "bound": self.config.most_lag},
            "learning_rate": self.learning_rate,
            "losses": dict(statistics.losses),
            "progress": progress,
            "budget": {"minutes": self.config.minutes, "frames": self.config.frames},
            "seconds": round(self.seconds(now), 1),
            "seconds_left": self._seconds_left(now, progress),
            "finished": self.finished,
            "duplicates": statistics.duplicates,
            "scenes": {
                scene: {"version": graph.version, "rooms": list(graph.rooms)}
                for scene, graph in self.graphs.scenes.items()
            },
            "replay": None if self._schedule is None else self._schedule.status(),
            "actors": {process: actor.summary(now) for process, actor in statistics.actors.items()},
        }

    def rooms_to_open(self) -> list[RoomId]:
        """Return the rooms whose views this run needs, as far as it knows, and that are not open."""
        if self._rollouts is None:
            return []
        rooms = map(RoomId.parse, self.graphs.rooms)
        return [room for room in rooms if not self._rollouts.has_room(room)]

    # --- what the shell tells ---

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take an event in.

        Args:
            event: What happened.
            now: Time in seconds, from any clock that never runs backwards.

        Returns:
            What to do, in this order.
        """
        match event:
            case GradientReceived(request, push):
                effects = self._gradient(request, push, now)
            case EpisodesReceived():
                effects = self._episodes(event, now)
            case RoomGraphReceived(request, push):
                effects = self._room_graph(request, push, now)
            case TrajectoryReceived(request, push):
                effects = self._trajectory(request, push, now)
            case RoomOpened() | RoomUnusable():
                effects = self._room_news(event)
            case Tick():
                effects = iter(())
        return [*effects, *self._housekeeping(now)]

    def _gradient(self, request: int, push: GradientPush, now: float) -> Iterator[Effect]:
        sender = Sender("gradient", push.actor, push.incarnation)
        if (settled := self._settled(request, sender, push)) is not None:
            yield settled
            return
        if self._schedule is not None and self._schedule.turn(push.actor, push.sequence) == "later":
            yield Reply(request, Busy(self.epoch))
            return
        vector, norm = self._decompressor.decompress(push.gradient, lag_weight(self.version - push.version))
        bound = self.config.gradient_norm
        if not math.isfinite(norm):
            yield self._refuse(request, Reason.NONFINITE, "gradient holds NaN or infinity")
            return
        # Actors scale their gradients down; what exceeds the bound by more than rounding is not one of theirs.
        if norm > bound * (1.0 + NORM_TOLERANCE):
            yield self._refuse(request, Reason.NORM, f"norm {norm:.6g}, the bound is {bound:g}")
            return
        yield from self._apply(sender, push, Learnt(vector, push.frames), now)
        yield PublishParameters()
        yield Reply(request, self._accepted())

    def _settled(self, request: int, sender: Sender, push: GradientPush | TrajectoryPush) -> Reply | None:
        """Return the answer to a push that counted before, or that cannot be used; None when it may be."""
        if (sender, push.sequence) in self._seen:
            return self._repeated(request)
        refusal = self._admission.refusal(push, self.version, finished=self.finished)
        return None if refusal is None else self._refuse(request, *refusal)

    def _trajectory(self, request: int, push: TrajectoryPush, now: float) -> Iterator[Effect]:
        sender = Sender("trajectory", push.actor, push.incarnation)
        if (settled := self._settled(request, sender, push)) is not None:
            yield settled
            return
        assert self._rollouts is not None  # noqa: S101 - otherwise it was refused
        try:
            missing = self._rollouts.missing(push, self.graphs.rooms)
            if missing or (self._schedule is not None and self._schedule.turn(push.actor, push.sequence) == "later"):
                yield from map(OpenRoom, missing)
                yield Reply(request, Busy(self.epoch))
                return
            learnt = self._rollouts.learn(push)
        except RejectedError as error:
            yield self._refuse(request, error.reason, error.detail)
            return
        if learnt.loss is not None and learnt.frames:
            self.statistics.learnt(learnt.loss.terms())
        # V-trace has accounted for the lag already, and the gradient is of the parameters as they are.
        yield from self._apply(sender, push, learnt, now)
        yield PublishParameters()
        yield Reply(request, self._accepted())

    def _apply(
        self, sender: Sender, push: GradientPush | TrajectoryPush, learnt: Learnt, now: float
    ) -> Iterator[Effect]:
        lag = self.version - push.version
        self._clock.push(now)
        self._optimizer.set_progress(self.progress(now) or 0.0)
        if self._schedule is not None:
            self._optimizer.learning_rate = self._schedule.take(push.version)
        if learnt.frames:  # Adam would make a full step of a rollout of which nothing is known
            self._optimizer.step(learnt.gradient)
        self._seen.add(sender, push.sequence)
        self.version += 1
        self.statistics.applied(push.actor, push.incarnation, learnt.frames, lag, now)
        self._save_within(self._checkpoint_seconds, now)
        yield RecordUpdate(
            UpdateRecord(push.actor, push.incarnation, push.sequence, push.version, lag, self._optimizer.learning_rate)
        )

    def _episodes(self, event: EpisodesReceived, now: float) -> Iterator[Effect]:
        push = event.push
        sender = Sender("episodes", push.actor, push.incarnation)
        if (sender, push.sequence) in self._seen:
            yield self._repeated(event.request)
            return
        self._seen.add(sender, push.sequence)
        actor = self.statistics.actor(push.actor, push.incarnation, now)
        if self._rollouts is None:  # otherwise this process computes the losses itself
            told = {name: getattr(push, name) for name in LOSS_TERMS}
            self.statistics.losses = {name: value for name, value in told.items() if value is not None}
        for episode in push.episodes:
            actor.rooms.add(str(episode.room))
            self.statistics.finished(episode.room.scene, success=episode.success)
        self._save_within(self._checkpoint_seconds, now)
        yield Reply(event.request, self._accepted())

    def _room_graph(self, request: int, push: RoomGraphPush, now: float) -> Iterator[Effect]:
        sender = Sender("room", push.actor, push.incarnation)
        if (sender, push.sequence) in self._seen:
            yield self._repeated(request)
            return
        try:
            if push.categories != TARGETS:
                raise RejectedError(Reason.NAME, "the categories are not the run's")  # noqa: TRY301 - one handler
            changed = self.graphs.add(RoomGraph(str(push.room), push.digest, push.nodes, push.edges))
        except RejectedError as error:
            yield self._refuse(request, error.reason, error.detail)
            return
        except InvalidValueError as error:
            yield self._refuse(request, Reason.RANGE, str(error))
            return
        self._seen.add(sender, push.sequence)
        self.statistics.actor(push.actor, push.incarnation, now).rooms.add(str(push.room))
        if not self.finished:
            self._clock.push(now)
        if changed:
            self._save_within(min(GRAPH_CHECKPOINT_SECONDS, self._checkpoint_seconds), now)
            yield PublishGraph(push.room)
        if self._rollouts is not None:
            self._rollouts.use_graph(self.graphs.scenes[push.room.scene])
            if not self._rollouts.has_room(push.room):
                yield OpenRoom(push.room)
        yield Reply(request, self._accepted())

    def _room_news(self, news: RoomOpened | RoomUnusable) -> Iterator[Effect]:
        if self._rollouts is not None:
            match news:
                case RoomOpened(views):
                    self._rollouts.add_room(views)
                case RoomUnusable(room, detail):
                    self._rollouts.refuse_room(room, detail)
        return iter(())

    def _repeated(self, request: int) -> Reply:
        self.statistics.duplicates += 1
        return Reply(request, self._accepted())

    def _refuse(self, request: int, reason: Reason, detail: str) -> Reply:
        return Reply(request, Refused(reason.value, detail, self.epoch))

    def _accepted(self) -> Accepted:
        return Accepted(self.epoch, self.version)

    def _housekeeping(self, now: float) -> Sequence[Effect]:
        """Finish when the budget is used up; save when it is time."""
        repeated = self._schedule is not None and self._schedule.done
        if not self.finished and (repeated or self.progress(now) == 1.0):
            self.finished = True
            self._clock.stop(now)
            self._checkpoint_due = None
            return SaveCheckpoint(keep=True), Finish()
        if self._milestone > self._kept:
            self._kept = self._milestone
            self._checkpoint_due = None
            return (SaveCheckpoint(keep=True),)
        if self._checkpoint_due is not None and now >= self._checkpoint_due:
            self._checkpoint_due = None
            return (SaveCheckpoint(keep=False),)
        return ()

    @property
    def _milestone(self) -> int:
        """Number of checkpoints to keep that the frames so far make up."""
        return self.statistics.frames // self._keep_every if self._keep_every else 0

    def _save_within(self, seconds: float, now: float) -> None:
        due = now + seconds
        self._checkpoint_due = due if self._checkpoint_due is None else min(self._checkpoint_due, due)

    def _seconds_left(self, now: float, progress: float | None) -> float | None:
        """Return the time left of the budget; None without a budget, or when it cannot be told yet."""
        if self.config.minutes is not None:
            return round(max(60.0 * self.config.minutes - self.seconds(now), 0.0), 1)
        rate = self.statistics.frames_per_second(now)
        if progress is None or self.config.frames is None or rate <= 0.0:
            return None
        return round(max(self.config.frames - self.statistics.frames, 0) / rate, 1)

    def _resume(self, checkpoint: Checkpoint, room_digests: Mapping[str, str]) -> None:
        check_fit(checkpoint.parameters.size, self._optimizer.size)
        self._optimizer = FlatAdam(checkpoint.parameters, self.config.learning_rate)
        self._optimizer.load_state(checkpoint.adam)
        self.version = checkpoint.version
        self.graphs = GraphStore(
            self.config.zones, room_digests, checkpoint.rooms, checkpoint.graph_versions, self.config.merging
        )
        self.statistics = Statistics(checkpoint.frames, checkpoint.episodes, checkpoint.recent)
        self._seen = SeenPushes(checkpoint.seen)
        self._clock = TrainingClock(checkpoint.seconds)
