"""The files in which `hoz-dist reproduce` leaves a table: Markdown, JSON and a picture."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hoz_dist.atomic import write_atomically
from hoz_dist.cli.reproducing.outcomes import read_outcomes
from hoz_dist.errors import InvalidValueError
from hoz_dist.reproduce.budget import Budget
from hoz_dist.reproduce.job import Job
from hoz_dist.reproduce.markdown import table_text
from hoz_dist.reproduce.outcome import Outcome
from hoz_dist.reproduce.row import Table
from hoz_dist.reproduce.summary import RowSummary, summarise


@dataclass(frozen=True)
class Results:
    """What is known of a table."""

    table: Table
    budget: Budget
    command: str
    seeds: str | None
    """Which seeds each row is trained with, as `--seeds` has it; None when they are as the budget says."""
    jobs: Mapping[str, Sequence[Job]]
    """Of each row, finished or not."""
    outcomes: Mapping[str, Mapping[int, Outcome]]
    """By row and seed."""
    summaries: Mapping[str, RowSummary]
    """By row."""

    @classmethod
    def read(
        cls,
        table: Table,
        budget: Budget,
        command: str,
        jobs: Mapping[str, Sequence[Job]],
        out: Path,
        *,
        seeds: str | None = None,
    ) -> "Results":
        """Read what is finished.

        Args:
            table: The table.
            budget: What every row gets.
            command: The command that makes the table.
            jobs: Of each row.
            out: Folder of everything.
            seeds: Which seeds each row is trained with, as `--seeds` has it; None when they are as the budget says.

        Raises:
            DamagedFileError: A file holds no outcome, or that of another job.
            InvalidValueError: Outcomes cannot be compared.
        """
        outcomes = read_outcomes(jobs, out)
        # Baselines are not trained, and like nobody else.
        agents = {
            name: name if of_row[0].training is None else of_row[0].training.digest for name, of_row in jobs.items()
        }
        return cls(table, budget, command, seeds, jobs, outcomes, summarise(outcomes, table.references, agents))

    @property
    def unfinished(self) -> dict[str, tuple[int, int]]:
        """Number of results and of those wanted, by row that lacks some."""
        numbers = {name: (len(self.outcomes[name]), len(of_row)) for name, of_row in self.jobs.items()}
        return {name: (finished, wanted) for name, (finished, wanted) in numbers.items() if finished < wanted}

    @property
    def stem(self) -> str:
        """What the table's files are called, less their suffixes; a table of other seeds is another one."""
        return f"{self.table.name}-{self.budget.name}" + ("" if self.seeds is None else f"-seeds-{self.seeds}")

    @property
    def hours(self) -> float:
        """Hours of one run after the other: training, choosing and testing."""
        seconds: dict[Path, float] = {}
        for name, of_row in self.jobs.items():
            for job in of_row:
                if job.seed not in self.outcomes[name]:
                    continue
                facts = self.outcomes[name][job.seed].facts
                if job.training is not None:  # which other tests may share
                    seconds[job.training.folder(Path())] = facts["training_seconds"] + facts["choice"]["seconds"]
                seconds[job.result(Path())] = facts["test_seconds"]
        return sum(seconds.values()) / 3600.0

    def text(self) -> str:
        """Return the table as Markdown."""
        text = table_text(self.table, self.budget, self.summaries, self.command, self.unfinished)
        if not self.summaries:
            return text
        folders = ", ".join(f"{name} `{self.jobs[name][0].result(Path()).parent}`" for name in self.summaries)
        return (
            f"{text}\n{self.hours:.1f} hours of runs in all. Every episode of each row, in the folder that the command "
            f"worked in (`--out`): {folders}.\n"
        )

    def to_json(self) -> dict[str, Any]:
        """Return everything but the results of episodes, for which each run names its file in the folder."""
        papers = {row.name: row.paper for row in self.table.rows if row.paper is not None}
        return {
            "table": self.table.name,
            "title": self.table.title,
            "note": self.table.note,
            "command": self.command,
            "budget": asdict(self.budget),
            "unfinished": {
                name: {"finished": finished, "wanted": wanted} for name, (finished, wanted) in self.unfinished.items()
            },
            "hours": round(self.hours, 2),
            "rows": {
                name: {
                    **summary.to_json(),
                    "paper": {
                        part: None if figures is None else figures._asdict()
                        for part, figures in papers[name]._asdict().items()
                    }
                    if name in papers
                    else None,
                    "runs": {
                        job.seed: {"file": str(job.result(Path())), **self.outcomes[name][job.seed].facts}
                        for job in self.jobs[name]
                        if job.seed in self.outcomes[name]
                    },
                }
                for name, summary in self.summaries.items()
            },
        }

    def is_session(self, noted: Mapping[str, Any]) -> bool:
        """Tell whether a start of the command, as it was noted, was for this table."""
        ours = (self.table.name, self.budget.name, str(self.seeds))
        return (noted["table"], noted.get("budget"), str(noted.get("seeds"))) == ours

    def refuse_to_replace_more(self, folder: Path) -> None:
        """Keep the table's files in a folder from being replaced by what lacks some of their results.

        Raises:
            InvalidValueError: They would be.
        """
        file = folder / f"{self.stem}.json"
        try:
            rows = json.loads(file.read_text("utf-8"))["rows"]
            there = [(name, int(seed)) for name, row in rows.items() for seed in row["runs"]]
        except (FileNotFoundError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return  # nothing, or nothing of ours that is worth keeping
        lost = [(name, seed) for name, seed in there if seed not in self.outcomes.get(name, {})]
        if lost:
            (name, seed), others = lost[0], len(lost) - 1
            what = f"that of '{name}' with seed {seed}" + (f" and {others} others" if others else "")
            message = (
                f"'{file}' has {len(there)} results, and what would replace it lacks {what}; finish the table, choose "
                "another folder, or delete the file first."
            )
            raise InvalidValueError(message)

    def write(self, folder: Path, sessions: Sequence[Mapping[str, Any]]) -> list[Path]:
        """Write the table's files, and return them.

        Args:
            folder: Where to put them; made when it is not there.
            sessions: How long each start of the command was expected to take, and took.
        """
        text = json.dumps(self.to_json() | {"sessions": list(sessions)}, indent=2) + "\n"
        contents = {"md": self.text().encode(), "json": text.encode()}
        if self.summaries:
            from hoz_dist.reproduce.plot import table_figure
            from hoz_dist.viz.zones import png

            contents["png"] = png(table_figure(self.table, self.summaries))
        folder.mkdir(parents=True, exist_ok=True)
        paths = {folder / f"{self.stem}.{suffix}": content for suffix, content in contents.items()}
        for path, content in paths.items():  # all are made by now, so that none is new beside old ones
            write_atomically(path, content, overwrite=True)
        return list(paths)
