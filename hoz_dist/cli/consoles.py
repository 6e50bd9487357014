"""Where results are printed: as wide as a terminal is, and wide enough for whole names in a file."""

from typing import Final

from rich.console import Console

FILE_WIDTH: Final = 200
"""Columns when the output is no terminal: scripts that search it must find names in one piece."""


def result_console(*, markup: bool = True) -> Console:
    """Return standard output.

    Args:
        markup: Whether square brackets in strings are styles.
    """
    console = Console(highlight=False, markup=markup)
    return console if console.is_terminal else Console(highlight=False, markup=markup, width=FILE_WIDTH)
