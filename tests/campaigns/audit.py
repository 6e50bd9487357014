"""Whether every acknowledged push counts exactly once, from nothing but files: journals, records and checkpoints.

A push that was acknowledged in epoch e is covered if the version at the answer is not beyond the one that the next
epoch began from, or, in the last epoch, the one of the last checkpoint. Pushes that make no version must be of an
earlier one: at the same version they may have come after the checkpoint was taken. What was acknowledged and is not
covered was lost with its learner, which is what a checkpoint interval may cost.
"""

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from hoz_dist.wire.protocol.message import MAX_EPISODES
from learner.checkpoint import Checkpoint, load_checkpoint
from learner.deduplication import SeenPushes, Sender
from learner.replay import read_updates
from tests.campaigns.journals import LEARNT_FROM, Acknowledged

Identity = tuple[str, int, int]
"""Actor, incarnation and sequence number of a gradient, or of a rollout in a run that learns from them."""
_KINDS: Final = {
    "gradient": "gradient",
    "trajectory": "trajectory",
    "episodes": "episodes",
    "room_graph_push": "room",
}
"""What the table of seen pushes calls the kinds of messages."""


@dataclass(frozen=True)
class AuditFigures:
    """What the files say."""

    epochs: int
    version: int
    """Of the last checkpoint."""
    acknowledged: dict[str, int]
    """Pushes by kind."""
    covered: dict[str, int]
    """Those among them that are covered by a checkpoint."""
    lost_with_their_learner: int
    """Gradients that were acknowledged and are not covered."""
    longest_loss_seconds: float
    """Longest time, from the first to the last of them in an epoch, in which one learner acknowledged them."""
    applied_unacknowledged: int
    """Gradients in the record whose actor was killed before it heard of it."""
    problems: list[str]


class Audit(NamedTuple):
    """The figures, and what they are drawn from."""

    figures: AuditFigures
    record: Counter[Identity]
    """How often each gradient is in the joined record."""
    lasting: list[Acknowledged]
    """The gradients that were acknowledged and are covered."""


class _Epoch(NamedTuple):
    number: int
    from_version: int
    updates: list[Identity]


def audit(run: Path, pushes: Sequence[Acknowledged]) -> Audit:
    """Compare what actors were told with what a run, which nobody serves any more, kept.

    Args:
        run: The run's folder.
        pushes: All that was acknowledged.
    """
    epochs, checkpoint = _epochs(run), load_checkpoint(run)
    record = Counter(_joined(epochs))
    covered = [push for push in pushes if _is_covered(push, _bound(push.epoch, epochs, checkpoint))]
    gradients = [push for push in covered if push.kind in LEARNT_FROM]
    lost = sorted(set(pushes).difference(covered, (push for push in pushes if push.kind not in LEARNT_FROM)))
    told = {_identity(push) for push in pushes if push.kind in LEARNT_FROM}
    figures = AuditFigures(
        epochs=len(epochs),
        version=checkpoint.version,
        acknowledged=dict(Counter(push.kind for push in pushes)),
        covered=dict(Counter(push.kind for push in covered)),
        lost_with_their_learner=len(lost),
        longest_loss_seconds=round(_longest_span(lost), 1),
        applied_unacknowledged=sum(identity not in told for identity in record),
        problems=[
            *_problems_of_record(run, epochs, record, checkpoint),
            *(
                f"a gradient counts {record[_identity(push)]} times: {push}"
                for push in gradients
                if record[_identity(push)] != 1
            ),
            *_forgotten(covered, checkpoint),
            *_repeated(pushes),
            *_miscounted(pushes, covered, record, checkpoint),
        ],
    )
    return Audit(figures, record, gradients)


def _epochs(run: Path) -> list[_Epoch]:
    """Read the record of each epoch."""
    epochs = []
    for path in sorted((run / "updates").glob("epoch-*.jsonl")):
        first, *lines = [json.loads(line) for line in path.read_text().splitlines(keepends=True) if line.endswith("\n")]
        updates = [(line["actor"], line["incarnation"], line["sequence"]) for line in lines]
        epochs.append(_Epoch(first["epoch"], first["from_version"], updates))
    return epochs


def _joined(epochs: Iterable[_Epoch]) -> list[Identity]:
    """Return the updates that last: what an epoch did beyond the beginning of the next one does not."""
    record: list[Identity] = []
    for epoch in epochs:
        record[epoch.from_version :] = epoch.updates
    return record


def _bound(epoch: int, epochs: Sequence[_Epoch], checkpoint: Checkpoint) -> int:
    """Return the version up to which an epoch's updates last."""
    return next((later.from_version for later in epochs if later.number > epoch), checkpoint.version)


def _is_covered(push: Acknowledged, bound: int) -> bool:
    return push.version < bound or (push.version == bound and push.kind in LEARNT_FROM)


def _longest_span(lost: Iterable[Acknowledged]) -> float:
    times: dict[int, list[float]] = {}
    for push in lost:
        times.setdefault(push.epoch, []).append(push.time)
    return max((max(some) - min(some) for some in times.values()), default=0.0)


def _identity(push: Acknowledged) -> Identity:
    return push.actor, push.incarnation, push.sequence


def _problems_of_record(
    run: Path, epochs: Sequence[_Epoch], record: Counter[Identity], checkpoint: Checkpoint
) -> list[str]:
    problems = [f"{identity} is in the record {count} times" for identity, count in record.items() if count > 1]
    if record.total() != checkpoint.version:
        problems.append(f"the record has {record.total()} updates, the last checkpoint is version {checkpoint.version}")
    read = [(update.actor, update.incarnation, update.sequence) for update in read_updates(run)]
    if read != _joined(epochs):
        problems.append("the learner's own reader reads another record")
    return problems


def _forgotten(covered: Iterable[Acknowledged], checkpoint: Checkpoint) -> list[str]:
    """Name the pushes that the last checkpoint does not know as taken, so that they could be taken twice."""
    seen = SeenPushes(checkpoint.seen)
    return [
        f"the table of seen pushes lacks {push}"
        for push in covered
        if (Sender(_KINDS[push.kind], push.actor, push.incarnation), push.sequence) not in seen
    ]


def _repeated(pushes: Iterable[Acknowledged]) -> list[str]:
    """Name the pushes that an actor was told twice about: it must not send what was acknowledged."""
    counts = Counter((push.kind, *_identity(push)) for push in pushes)
    return [f"{push} was acknowledged {count} times" for push, count in counts.items() if count > 1]


def _miscounted(
    pushes: Sequence[Acknowledged],
    covered: Sequence[Acknowledged],
    record: Counter[Identity],
    checkpoint: Checkpoint,
) -> list[str]:
    """Name the counters that are not what the pushes add up to.

    Of a push whose actor was killed before it heard of it nobody wrote down how much it counted, only
    that it was taken.
    """
    frames = {_identity(push): push.frames for push in pushes if push.kind in LEARNT_FROM}
    most = sum(frames.get(identity, 0) for identity in record)
    # Of a rollout the learner counts the steps at which it knows the state; all, unless a learner was replaced.
    least = 0 if any(push.kind == "trajectory" for push in pushes) else most
    most_frames = checkpoint.config.batch * checkpoint.config.rollout_steps
    unknown = sum(identity not in frames for identity in record)
    least_episodes = sum(push.episodes for push in covered)
    most_episodes = sum(push.episodes for push in pushes) + MAX_EPISODES * _unheard_episodes(pushes, checkpoint)
    problems = []
    if not least <= checkpoint.frames <= most + unknown * most_frames:
        problems.append(f"{checkpoint.frames} frames were counted, not {most} and those of {unknown} pushes")
    if not least_episodes <= checkpoint.episodes <= most_episodes:
        problems.append(f"{checkpoint.episodes} episodes were counted, not {least_episodes} to {most_episodes}")
    return problems


def _unheard_episodes(pushes: Sequence[Acknowledged], checkpoint: Checkpoint) -> int:
    """Return the number of pushes of episodes that were taken without the actor's knowing; one for each at most."""
    heard = {_identity(push) for push in pushes if push.kind == "episodes"}
    senders = [row for row in checkpoint.seen if row[0] == "episodes"]
    return sum((actor, incarnation, newest) not in heard for _, actor, incarnation, newest, _ in senders)
