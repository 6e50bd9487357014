import os
from pathlib import Path

from hoz_dist.cli.report import report
from learner.checkpoint import FOLDER, save_checkpoint
from learner.core import LearnerCore
from learner.events import RoomGraphReceived
from tests.unit.learner.making import CONFIG, answer, room_graph, room_push, vector


def test_who_looks_at_a_picture_while_it_is_made_anew_sees_the_old_one(tmp_path: Path) -> None:
    core = LearnerCore(CONFIG, vector(0), epoch=1)
    answer(core, RoomGraphReceived(0, room_push(0, room_graph("kitchen/2"))))
    save_checkpoint(tmp_path / FOLDER, core.snapshot(now=5.0))
    picture, opened = tmp_path / "zones-kitchen.png", tmp_path / "opened"
    picture.write_bytes(b"old")
    os.link(picture, opened)
    report(tmp_path, episodes=0, seed=0, weights=None, cache=None)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert opened.read_bytes() == b"old"
