"""The configuration of a router: what `zenohd --config router.json5` and `hoz-dist router --config` need."""

import json
from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath
from typing import Any, Final

from hoz_dist.security.access_control import access_control
from hoz_dist.security.register import Identity
from hoz_dist.wire.transport.credentials import AUTHORITY_FILE, CERTIFICATE_FILE, KEY_FILE
from hoz_dist.wire.transport.settings import router_settings, tls_settings

_HEAD: Final = """\
// Configuration of the Zenoh router '{name}' for hoz-dist: run `zenohd --config router.json5` (version 1.10), or
// `hoz-dist router --config router.json5`. `hoz-dist keys` writes it anew whenever it issues or withdraws a key: copy
// it to the router's machine again, and start the router again.
"""


def router_file(router: Identity, everybody: Iterable[Identity]) -> bytes:
    """Return a router's configuration, JSON5.

    Args:
        router: The router.
        everybody: All who have a key.
    """
    folder = PurePosixPath(router.at)
    settings = router_settings() | {
        "listen/endpoints": list(router.listen),
        "access_control": access_control(everybody),
    }
    settings |= tls_settings(folder / AUTHORITY_FILE, folder / CERTIFICATE_FILE, folder / KEY_FILE)
    return (_HEAD.format(name=router.name) + json.dumps(_nested(settings), indent=2) + "\n").encode()


def _nested(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by path as a tree."""
    tree: dict[str, Any] = {}
    for path, value in settings.items():
        *folders, name = path.split("/")
        place = tree
        for folder in folders:
            place = place.setdefault(folder, {})
        place[name] = value
    return tree
