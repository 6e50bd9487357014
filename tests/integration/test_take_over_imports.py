"""A standby has everything imported when it takes over: actors and robots wait for it."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.integration

_STANDBY = """
import sys
from pathlib import Path
from learner.core import LearnerCore
from learner.events import RoomGraphReceived
from learner.service import LearnerSettings, _Cores
from tests.integration.learning import CONFIG, graph_of
from tests.unit.learner.making import room_push

run = Path(sys.argv[1])
cores = _Cores(LearnerSettings(connect="tcp/127.0.0.1:7447", run=run, config=CONFIG))
before = set(sys.modules)
led = cores.make(1, None)
for number, room in enumerate(("bathroom/7", "bathroom/10")):
    led.handle(RoomGraphReceived(0, room_push(number, graph_of(room))), 0.0)
cores.make(2, led.snapshot(0.0))
print(*sorted({name.partition(".")[0] for name in set(sys.modules) - before}))
"""


def test_taking_over_a_run_with_rooms_imports_nothing(tmp_path: object) -> None:
    command = [sys.executable, "-c", _STANDBY, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "\n"
