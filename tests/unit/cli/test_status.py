"""How a status reads, and watching one while the learner comes and goes."""

import io
import json
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from click.testing import CliRunner
from rich.console import Console

from hoz_dist.cli.status import status_command
from hoz_dist.cli.status_text import status_line, status_page
from hoz_dist.cli.watching import Look, Page, Watcher, look_page, print_json, print_line
from hoz_dist.errors import ConnectionFailedError, InvalidValueError, NotFoundError

NOON = datetime(2024, 5, 1, 12, 0, 0, tzinfo=UTC)


def process(role: str, name: str, host: str = "h1", **measured: Any) -> dict[str, Any]:
    nothing = {"incarnation": 1, "rooms": [], "frames": 0, "frames_per_second": 0.0, "lag": 0.0, "rejected": 0}
    return {"role": role, "id": name, "host": host, **nothing, **measured}


def left(role: str, name: str, seconds: float = 75.0, host: str = "h1") -> dict[str, Any]:
    return {"role": role, "id": name, "host": host, "incarnation": 1, "seconds": seconds}


def status(*processes: dict[str, Any], **fields: Any) -> dict[str, Any]:
    return {"version": 1500, "epoch": 2, "processes": list(processes), "left": [], "rejected": {}, **fields}


def text_of(page: Any, width: int = 120) -> str:
    out = io.StringIO()
    Console(file=out, width=width).print(page)
    return out.getvalue()


def rows_of(text: str, table: str) -> list[list[str]]:
    """The cells below a table's title."""
    lines = text.split(table, 1)[1].splitlines()
    cells = [[cell.strip() for cell in line.strip("│").split("│")] for line in lines if line.startswith("│")]
    end = next((index for index, line in enumerate(lines) if line.startswith("└")), len(lines))
    return cells[: sum(line.startswith("│") for line in lines[:end])]


def test_a_page_lists_who_lives_and_apart_from_them_who_left() -> None:
    actor = process(
        *("actor", "a0", "gpu-3"),
        rooms=["kitchen/1", "kitchen/2"],
        frames=12345,
        frames_per_second=321.4,
        lag=1.25,
        rejected=2,
    )
    page = text_of(
        status_page(
            status(
                *(actor, process("learner", "l0"), process("standby", "l1", "h2")),
                left=[left("actor", "a1", host="h9"), left("learner", "l2", 4.0)],
                rejected={"norm": 1200, "epoch": 3},
            )
        )
    )
    assert page.startswith("version 1,500 of epoch 2\n")
    assert rows_of(page, "Live processes") == [
        ["learner", "l0", "h1", "", "", "", "", ""],
        ["standby", "l1", "h2", "", "", "", "", ""],
        ["actor", "a0", "gpu-3", "kitchen/1, kitchen/2", "12,345", "321", "1.2", "2"],
    ]
    assert rows_of(page, "Left") == [["actor", "a1", "h9", "1 min 15 s"], ["learner", "l2", "h1", "4 s"]]
    assert "Rejected messages: epoch 3, norm 1,200\n" in page
    assert "share a name" not in page


def test_a_page_without_departures_and_rejections_says_so_briefly() -> None:
    page = text_of(status_page(status(process("learner", "l0"))))
    assert "Left" not in page
    assert "Rejected messages: none" in page


def test_many_rooms_are_counted_by_scene() -> None:
    rooms = [f"kitchen/{number}" for number in range(1, 21)] + ["bedroom/1"]
    page = text_of(status_page(status(process("actor", "a0", rooms=rooms))))
    assert rows_of(page, "Live processes")[0][3] == "kitchen (20), bedroom (1)"


def test_live_actors_of_one_name_are_pointed_out_in_one_line() -> None:
    twins = status(
        *(process("actor", "a0", "h1"), process("actor", "a0", "h2", incarnation=2), process("actor", "a1")),
        # A leader and its standby have their host's name by default: no mistake.
        *(process("learner", "h1"), process("standby", "h1"), process("actor", "h1")),
    )
    line = "Live actors share a name: a0 on h1 and h2. They play the same episodes; give each a --name of its own."
    assert line in text_of(status_page(twins)).splitlines()
    assert status_line(twins).endswith(f"; {line}")


def test_names_are_not_cut_on_a_narrow_terminal_and_not_taken_for_markup() -> None:
    long = "node-0123456789-0123456789-0123456789"
    page = text_of(status_page(status(process("actor", long, rooms=["[bold]x"]))), width=60)
    assert "[bol" in page
    assert "…" not in page


def test_a_line_says_how_it_goes_who_takes_part_and_who_left() -> None:
    line = status_line(
        status(
            *(process("learner", "l0"), process("actor", "a0"), process("actor", "a1")),
            frames=1000,
            frames_per_second=250.0,
            success={"overall": 0.5},
            progress=0.25,
            left=[left("actor", f"b{number}") for number in range(5)],
            rejected={"epoch": 3},
        )
    )
    assert line == (
        "version 1,500 of epoch 2, 1,000 frames, 250 frames/s, success 50%, 25% done, 1 learner, 2 actors, "
        "left: actor b0 + actor b1 + actor b2 + 2 more, rejected: epoch 3"
    )


class Script:
    """A client that answers what it is told, one thing after the other."""

    def __init__(self, *answers: dict[str, Any] | Exception) -> None:
        self.answers = list(answers)
        self.closed = 0
        self.opened = 0
        self.unreachable = 0

    def open(self) -> "Script":
        if self.unreachable:
            self.unreachable -= 1
            message = "No router."
            raise ConnectionFailedError(message)
        self.opened += 1
        return self

    def status(self) -> dict[str, Any]:
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        self.closed += 1


def looks(script: Script, count: int) -> list[Look]:
    seconds = iter(range(1000))
    with Watcher(script.open, now=lambda: NOON + timedelta(seconds=next(seconds))) as watcher:
        return [watcher.look() for _ in range(count)]


def test_a_watcher_survives_a_router_that_is_not_there_and_a_learner_that_goes() -> None:
    first, second = status(version=1), status(version=2)
    gone = ConnectionFailedError("It does not answer.")
    script = Script(NotFoundError("No run."), first, gone, InvalidValueError("Two learners serve it."), second)
    script.unreachable = 2
    seen = looks(script, 7)
    assert [look.status for look in seen] == [None, None, None, first, first, first, second]
    silent = [look.silent_since for look in seen]
    assert silent[0] == silent[1] == silent[2] == NOON
    assert silent[3] is silent[6] is None
    assert silent[4] == silent[5]
    assert silent[4] is not None
    assert silent[4] > NOON
    assert [look.problem for look in seen[2:6]] == ["No run.", "", "It does not answer.", "Two learners serve it."]
    assert (script.opened, script.closed) == (1, 1)


def test_a_watcher_that_has_seen_no_status_reports_what_is_the_users_to_mend() -> None:
    script = Script(InvalidValueError("Several runs."))
    with pytest.raises(InvalidValueError, match="Several runs"):
        looks(script, 1)
    assert script.closed == 1


def test_the_last_status_stays_in_sight_while_no_learner_answers() -> None:
    silent = Look(NOON + timedelta(seconds=9), status(process("actor", "a0")), NOON, "It may have stopped.")
    page = text_of(look_page(silent))
    assert page.splitlines()[1] == "no learner answers since 12:00:00: It may have stopped."
    assert rows_of(page, "Live processes")[0][1] == "a0"


def test_a_terminal_is_renewed_in_place() -> None:
    out = io.StringIO()
    with Page(Console(file=out, force_terminal=True, width=100, height=30)) as page:
        page.show(Look(NOON, status(version=1)))
        page.show(Look(NOON, status(version=2)))
    assert "\x1b[1A" in out.getvalue()  # up a line: what was there is written over


def test_elsewhere_each_renewal_is_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    known = status(process("learner", "l0"))
    print_line(Look(NOON, known))
    print_line(Look(NOON, known, NOON, "Gone."))
    print_line(Look(NOON, None, NOON, "Nobody."))
    assert capsys.readouterr().out.splitlines() == [
        "12:00:00 version 1,500 of epoch 2, 1 learner",
        "12:00:00 no learner answers since 12:00:00: Gone.",
        "12:00:00 no learner answers since 12:00:00: Nobody.",
    ]


def test_scripts_get_an_object_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    print_json(Look(NOON, status()))
    print_json(Look(NOON, status(), NOON, "Gone."))
    answered, silent = map(json.loads, capsys.readouterr().out.splitlines())
    assert answered == {"time": "2024-05-01T12:00:00+00:00", **status()}
    assert silent == {
        "time": "2024-05-01T12:00:00+00:00",
        "silent_since": "2024-05-01T12:00:00+00:00",
        "problem": "Gone.",
    }


def test_a_period_needs_something_to_repeat() -> None:
    result = CliRunner().invoke(status_command, ["--every", "3"])
    assert result.exit_code == 2
    assert "--every is the time between two renewals: it needs --watch." in result.output
