"""Which seeds each row of a table is trained with: `5` for the first five, `5-14` for these ten."""

import re
from typing import Final

import click

MOST: Final = 100
"""Every seed is less."""


class SeedsType(click.ParamType[range]):
    """Reads `N`, the seeds 0 to N - 1, or `FIRST-LAST`."""

    name = "N|FIRST-LAST"

    def convert(self, value: str | range, param: click.Parameter | None, ctx: click.Context | None) -> range:
        """Return the seeds."""
        if isinstance(value, range):
            return value
        match = re.fullmatch(r"(?:(\d{1,4})-)?(\d{1,4})", value)
        if match is None:
            self.fail(f"'{value}' is neither a number of seeds nor FIRST-LAST, such as 5-14.", param, ctx)
        first, last = match.groups()
        seeds = range(int(last)) if first is None else range(int(first), int(last) + 1)
        if not seeds or seeds[-1] >= MOST:
            self.fail(f"'{value}' is no range of seeds from 0 to {MOST - 1}; give FIRST before LAST.", param, ctx)
        return seeds


def seeds_text(seeds: range) -> str:
    """Return what `SeedsType` reads as these seeds."""
    return str(len(seeds)) if seeds.start == 0 else f"{seeds.start}-{seeds[-1]}"
