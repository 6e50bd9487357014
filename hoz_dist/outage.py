"""Saying once that something fails, and once that it works again, however often it is tried in between."""

import logging


class Outage:
    """Whether something fails at the moment.

    Args:
        log: Where to say so.
        failing: Said, as a warning, when it begins to fail; ``%``-formatted with the arguments of `failed`.
        back: Said when it works again.
    """

    def __init__(self, log: logging.Logger, failing: str, back: str) -> None:
        self._log = log
        self._failing = failing
        self._back = back
        self._lasts = False

    def failed(self, *details: object) -> None:
        """Note that it failed."""
        if not self._lasts:
            self._log.warning(self._failing, *details)
        self._lasts = True

    def worked(self) -> None:
        """Note that it worked."""
        if self._lasts:
            self._log.info(self._back)
        self._lasts = False
