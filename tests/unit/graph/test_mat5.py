import io
import struct
import tracemalloc
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat

from hoz_dist.errors import InvalidValueError
from hoz_dist.graph.mat5 import read_mat5


def mat_file(tables: dict[str, Any], *, packed: bool = False) -> bytes:
    file: Any = io.BytesIO()
    savemat(file, tables, do_compression=packed)
    content: bytes = file.getvalue()
    return content


def small_element(kind: int, data: bytes) -> bytes:
    return struct.pack("<HH", kind, len(data)) + data.ljust(4, b"\0")


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.booleans(), st.text("abc_", min_size=1, max_size=9))
def test_tables_are_those_that_scipy_reads(rows: int, columns: int, packed: bool, name: str) -> None:
    name = f"t{name}"
    table = np.random.default_rng(rows * columns).random((rows, columns))
    content = mat_file({name: table, "other": "text"}, packed=packed)
    file: Any = io.BytesIO(content)
    tables = read_mat5(content, [name, "other"])
    assert list(tables) == [name]
    np.testing.assert_array_equal(tables[name], loadmat(file)[name])


def test_whole_doubles_may_be_stored_as_small_integers() -> None:
    # As MATLAB itself writes np.eye(2): numbers of type uint8, in a small element.
    body = (
        struct.pack("<IIII", 6, 8, 6, 0)
        + struct.pack("<IIii", 5, 8, 2, 2)
        + small_element(1, b"edge")
        + small_element(2, bytes([1, 0, 0, 1]))
    )
    header = mat_file({})[:128]
    variable = struct.pack("<II", 14, len(body)) + body
    packed = zlib.compress(variable)
    for content in (variable, struct.pack("<II", 15, len(packed)) + packed):
        np.testing.assert_array_equal(read_mat5(header + content, ["edge"])["edge"], np.eye(2))


@pytest.mark.parametrize("value", [1j * np.eye(2), np.eye(2, dtype=np.uint8), "text", {"field": 1}, [["a", 1.0]]])
def test_everything_else_is_passed_over(value: Any) -> None:
    assert list(read_mat5(mat_file({"other": value, "edges": np.eye(2)}), ["other", "edges"])) == ["edges"]


def test_only_tables_that_are_asked_for_are_kept() -> None:
    content = mat_file({"other": np.eye(3), "edges": np.eye(2)})
    assert list(read_mat5(content, ["edges"])) == ["edges"]


@pytest.mark.parametrize(("side", "count"), [(1000, 1), (500, 3)])
def test_file_that_unpacks_to_too_much_is_refused(side: int, count: int) -> None:
    content = mat_file({f"table{number}": np.zeros((side, side)) for number in range(count)}, packed=True)
    with pytest.raises(InvalidValueError, match="unpacks to more than 4 MiB"):
        read_mat5(content, ["edges"])


def test_small_file_that_unpacks_to_gigabytes_takes_little_memory() -> None:
    header, variable = mat_file({})[:128], mat_file({"edges": np.zeros((700, 700))}, packed=True)[128:]
    tracemalloc.start()
    try:
        with pytest.raises(InvalidValueError, match="unpacks to more than"):
            read_mat5(header + variable * 500, ["edges"])
        assert tracemalloc.get_traced_memory()[1] < 32 * 1024**2
    finally:
        tracemalloc.stop()


@settings(max_examples=300, deadline=None)
@given(st.booleans(), st.lists(st.tuples(st.integers(100, 700), st.integers(0, 255)), max_size=5), st.integers(0, 700))
def test_damage_is_noticed_or_harmless(packed: bool, changes: list[tuple[int, int]], cut: int) -> None:
    content = bytearray(mat_file({"edges": np.eye(8)}, packed=packed))
    for place, value in changes:
        content[place % len(content)] = value
    try:
        tables = read_mat5(bytes(content[: len(content) - cut]), ["edges"])
    except InvalidValueError:
        return
    assert all(table.dtype == np.float64 and table.ndim == 2 for table in tables.values())


def test_cut_is_noticed_even_in_what_is_passed_over() -> None:
    whole, shorter = mat_file({"edges": np.eye(2), "other": "text"}), mat_file({"edges": np.eye(2)})
    for length in range(len(shorter) + 1, len(whole)):
        with pytest.raises(InvalidValueError, match="do not fit together"):
            read_mat5(whole[:length], ["edges"])


def test_packed_variable_without_its_end_is_refused() -> None:
    content = mat_file({"edges": np.eye(2)}, packed=True)
    stream = content[136:-4]  # without the checksum at its end
    with pytest.raises(InvalidValueError, match="do not fit together"):
        read_mat5(content[:128] + struct.pack("<II", 15, len(stream)) + stream, ["edges"])
