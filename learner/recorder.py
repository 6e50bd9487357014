"""What the learner writes down as it goes: TensorBoard scalars and the record of updates."""

from pathlib import Path
from typing import Any

from torch.utils.tensorboard import SummaryWriter

from learner.replay import UpdateRecord


class ScalarRecorder:
    """TensorBoard scalars over frames.

    Args:
        folder: Folder of the logs.
        frames: Frames so far; what an earlier learner logged beyond them, and lost, is hidden.
    """

    def __init__(self, folder: Path, frames: int) -> None:
        self._writer = SummaryWriter(str(folder), purge_step=frames or None)

    def record(self, status: dict[str, Any]) -> None:
        """Write the scalars of a status, see `LearnerCore.status`."""
        success, lag = status["success"], status["lag"]
        scalars: dict[str, float | None] = {
            "n_frames": status["frames"],
            "n_episodes": status["episodes"],
            "success/train": success["overall"],
            "perf/_fps": status["frames_per_second"],
            "train/version": status["version"],
            "train/version_diff_min": lag["min"],
            "train/version_diff_avg": lag["mean"],
            "train/version_diff_max": lag["max"],
            "train/learning_rate": status["learning_rate"],
        }
        scalars |= {f"success_{scene}/train": rate for scene, rate in success["scenes"].items()}
        scalars |= {f"loss/{name}": value for name, value in status["losses"].items()}
        for tag, value in scalars.items():
            if value is not None:
                self._writer.add_scalar(tag, value, status["frames"])

    def close(self) -> None:
        """Write what is still in memory."""
        self._writer.close()


class UpdateLog:
    """The record of applied updates; line v (from 0) made version v + 1.

    Args:
        path: The file.
        version: Version that the run goes on from; lines of updates that were lost with an earlier learner are cut off.
    """

    def __init__(self, path: Path, version: int) -> None:
        path.touch()
        with path.open("r+b") as file:
            for _ in range(version):
                file.readline()
            file.truncate()
        self._file = path.open("a", encoding="utf-8")

    def write(self, record: UpdateRecord) -> None:
        """Add an update; it is on the disk after the next `flush`."""
        self._file.write(record.to_line())

    def flush(self) -> None:
        """Hand all lines to the operating system."""
        self._file.flush()

    def close(self) -> None:
        """Write what is still in memory."""
        self._file.close()
