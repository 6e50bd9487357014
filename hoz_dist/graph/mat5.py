"""A reader of MATLAB 5 files for tables of real doubles, which is all that released graphs are made of.

SciPy's reader crashes the process on damaged files (about 1 in 60 with a few random bytes changed, SciPy 1.17) and
unpacks whatever they say they hold. This one reads every length before it trusts it, and unpacks little.

The format: a header of 128 bytes, then elements. An element is a tag (type and number of bytes) and data padded to 8
bytes; a small one has tag and data in 8 bytes. A variable is an element of elements: flags, shape, name, numbers; it
may be packed by zlib.
"""

import struct
import zlib
from collections.abc import Container, Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.errors import InvalidValueError

_HEADER_BYTES: Final = 128
_HEADER_END: Final = b"\x00\x01IM"
"""Version 1, little-endian."""
_TAG: Final = struct.Struct("<II")
_SMALL_TAG: Final = struct.Struct("<HH")
_MATRIX: Final = 14
_PACKED: Final = 15
_NUMBERS: Final = {1: "<i1", 2: "<u1", 3: "<i2", 4: "<u2", 5: "<i4", 6: "<u4", 7: "<f4", 9: "<f8", 12: "<i8", 13: "<u8"}
"""How numbers are stored, by type of element. MATLAB stores doubles that are whole as integers."""
_FRACTIONS: Final = frozenset({7, 9})
_DOUBLE_CLASS: Final = 6
_COMPLEX_FLAG: Final = 0x800
_MAX_UNPACKED: Final = 4 * 1024 * 1024
"""Most bytes of all packed variables of a file: no file is read that is larger, packed or not."""


def read_mat5(content: bytes, names: Container[str]) -> dict[str, NDArray[np.float64]]:
    """Read tables of real doubles in a MATLAB 5 file and pass over everything else.

    Args:
        content: Of the file.
        names: Of the tables to read.

    Returns:
        Those that there are, by name, float64 [rows, columns].

    Raises:
        InvalidValueError: It is not a MATLAB 5 file, it is damaged, or it unpacks to more than a graph can need.
    """
    if content[_HEADER_BYTES - len(_HEADER_END) : _HEADER_BYTES] != _HEADER_END:
        message = "It is not a MATLAB 5 file."
        raise InvalidValueError(message)
    tables = {}
    for kind, variable in _variables(content[_HEADER_BYTES:]):
        named = _table(variable) if kind == _MATRIX else None
        if named is not None and named[0] in names:
            tables[named[0]] = named[1]
    return tables


def _variables(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield type and data of each variable, unpacked."""
    left = _MAX_UNPACKED
    for kind, data in _elements(content):
        if kind == _PACKED:
            unpacked = _unpacked(data, left)
            left -= len(unpacked)
            yield from _elements(unpacked)
        else:
            yield kind, data


def _elements(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield type and data of each element."""
    start = 0
    while start < len(content):
        if start + _TAG.size > len(content):
            raise _damaged()
        kind, size = _TAG.unpack_from(content, start)
        begin, end = start + _TAG.size, start + _TAG.size + size
        # Packed variables are not padded.
        start = end if kind == _PACKED else end + -size % 8
        if kind >> 16:  # a small element: the size is in the upper half of the first number
            kind, size = _SMALL_TAG.unpack_from(content, begin - _TAG.size)
            begin -= _SMALL_TAG.size
            end, start = begin + size, begin + _SMALL_TAG.size
            if end > start:
                raise _damaged()
        if end > len(content):
            raise _damaged()
        yield kind, content[begin:end]


def _unpacked(data: bytes, most: int) -> bytes:
    """Unpack a variable of at most ``most`` bytes."""
    unpacker = zlib.decompressobj()
    try:
        unpacked = unpacker.decompress(data, most + 1)  # a limit of 0 would mean none
    except zlib.error as error:
        raise _damaged() from error
    if len(unpacked) > most:
        message = f"It unpacks to more than {_MAX_UNPACKED // 1024**2} MiB, which no graph needs."
        raise InvalidValueError(message)
    if not unpacker.eof:
        raise _damaged()
    return unpacked


def _table(variable: bytes) -> tuple[str, NDArray[np.float64]] | None:
    """Return name and values of a variable; None when it is not a table of real doubles."""
    elements = _elements(variable)
    flags = _whole_numbers(next(elements, None))
    if not flags.size or int(flags[0]) & 0xFF != _DOUBLE_CLASS or int(flags[0]) & _COMPLEX_FLAG:
        return None
    shape = [int(extent) for extent in _whole_numbers(next(elements, None))]
    name = _whole_numbers(next(elements, None)).astype(np.uint8).tobytes().decode("latin-1")
    values = _numbers(next(elements, None))
    rows_and_columns = ("rows", "columns")
    if len(shape) != len(rows_and_columns) or min(shape) < 0 or shape[0] * shape[1] != values.size:
        raise _damaged()
    return name, np.ascontiguousarray(values.reshape(shape, order="F"), dtype=np.float64)


def _numbers(element: tuple[int, bytes] | None) -> NDArray[np.generic]:
    """Return the numbers of an element of a variable."""
    if element is None or element[0] not in _NUMBERS:
        raise _damaged()
    kind, data = element
    dtype = np.dtype(_NUMBERS[kind])
    if len(data) % dtype.itemsize:
        raise _damaged()
    return np.frombuffer(data, dtype)


def _whole_numbers(element: tuple[int, bytes] | None) -> NDArray[np.generic]:
    """Return the numbers of an element that must be whole."""
    if element is not None and element[0] in _FRACTIONS:
        raise _damaged()
    return _numbers(element)


def _damaged() -> InvalidValueError:
    """Make the error of a file whose parts do not fit together."""
    return InvalidValueError("Its parts do not fit together.")
