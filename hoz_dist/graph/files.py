"""Scene graphs in files: JSON, msgpack and the released ``.mat``, told apart by the file's extension.

All three keep nodes and edges to the last bit.
"""

import json
from pathlib import Path
from typing import Final, Literal

from hoz_dist.atomic import write_atomically
from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError
from hoz_dist.graph.matlab import from_matlab, scene_of_file, to_matlab
from hoz_dist.graph.plain import from_plain, to_plain
from hoz_dist.graph.scene_graph import SceneGraph

Format = Literal["json", "msgpack", "mat"]

FORMATS: Final[dict[str, Format]] = {".json": "json", ".msgpack": "msgpack", ".mat": "mat"}
"""Format of each extension."""
MAX_FILE_BYTES: Final = 4 * 1024 * 1024
"""Larger files are refused: the largest graph, 64 zones by 1024 categories, needs about 1.5 MB."""


def save_graph(graph: SceneGraph, path: Path, *, overwrite: bool = False) -> None:
    """Write a scene graph atomically.

    Args:
        graph: The graph.
        path: File to write; its extension tells the format.
        overwrite: Whether an existing file may be replaced.

    Raises:
        NotFoundError: The folder does not exist.
        InvalidValueError: The extension is unknown, the file exists, or the format cannot hold the graph.
    """
    write_atomically(path, encode_graph(graph, format_of(path)), overwrite=overwrite)


def load_graph(path: Path, scene: str | None = None) -> SceneGraph:
    """Read a scene graph.

    Args:
        path: File to read; its extension tells the format.
        scene: Name of the scene, for ``.mat`` files, which do not hold it; ``None``: guessed from the file's name.

    Raises:
        NotFoundError: There is no such file.
        InvalidValueError: The extension is unknown.
        DamagedFileError: The file does not hold a scene graph.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
    except FileNotFoundError:
        message = f"There is no graph file '{path}'."
        raise NotFoundError(message) from None
    except IsADirectoryError:
        message = f"'{path}' is a folder, not a graph file."
        raise DamagedFileError(message) from None
    except OSError as error:
        message = f"Cannot read graph file '{path}': {error.strerror}."
        raise DamagedFileError(message) from error
    file_format = format_of(path)
    try:
        return decode_graph(content, file_format, scene if scene is not None else scene_of_file(path))
    except InvalidValueError as error:
        reason = str(error)
        message = f"'{path}' is not a graph file, or it is damaged: {reason[0].lower()}{reason[1:]}"
        raise DamagedFileError(message) from error


def format_of(path: Path) -> Format:
    """Return the format that a file's extension names.

    Raises:
        InvalidValueError: It names none.
    """
    try:
        return FORMATS[path.suffix.lower()]
    except KeyError:
        message = f"Cannot tell the format of '{path}' from its name; it must end in {', '.join(FORMATS)}."
        raise InvalidValueError(message) from None


def encode_graph(graph: SceneGraph, file_format: Format) -> bytes:
    """Return the content of a file that holds a graph.

    Raises:
        InvalidValueError: The format cannot hold the graph.
    """
    if file_format == "json":
        return json.dumps(to_plain(graph), allow_nan=False).encode()
    if file_format == "msgpack":
        import msgpack  # noqa: PLC0415 - loaded only by who needs it

        packed: bytes = msgpack.packb(to_plain(graph))
        return packed
    return to_matlab(graph)


def decode_graph(content: bytes, file_format: Format, scene: str) -> SceneGraph:
    """Read the content of a file that holds a graph.

    Args:
        content: Of the file.
        file_format: Its format.
        scene: Name of the scene for ``mat``, which does not hold it; the other formats do.

    Raises:
        InvalidValueError: It holds no scene graph.
    """
    if not content:
        message = "It is empty."
        raise InvalidValueError(message)
    if len(content) > MAX_FILE_BYTES:
        message = f"It is larger than {MAX_FILE_BYTES // 1024**2} MiB."
        raise InvalidValueError(message)
    if file_format == "mat":
        return from_matlab(content, scene)
    return from_plain(_read_json(content) if file_format == "json" else _read_msgpack(content))


def _read_json(content: bytes) -> object:
    try:
        return json.loads(content)
    except (ValueError, RecursionError) as error:
        message = "It is not JSON."
        raise InvalidValueError(message) from error


def _read_msgpack(content: bytes) -> object:
    import msgpack  # noqa: PLC0415 - loaded only by who needs it

    try:
        return msgpack.unpackb(content)
    except (ValueError, TypeError, msgpack.UnpackException) as error:
        message = "It is not msgpack."
        raise InvalidValueError(message) from error
