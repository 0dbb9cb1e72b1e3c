"""Rows out of a damaged file page by page, where the pages that lead to them are lost.

SQLite finds a row by the tree above it, and of a file that was cut off the top of a tree may lie
past the end. The leaves stand for themselves (https://www.sqlite.org/fileformat2.html, 1.6 and 2):
whoever takes a row from here has to check it, for a page may be one that was given up long ago.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Final

_LEAF_OF_TABLE: Final = 0x0D
_HEADER: Final = 8
_FIRST_PAGE_HEADER: Final = 100
_INT_BYTES: Final = (0, 1, 2, 3, 4, 6, 8)
# No row of ours is longer, and a damaged page may say anything.
_MAX_PAYLOAD: Final = 10_000_000


class _Broken(ValueError):
    """Bytes that are no row."""


def carve(path: Path, page_size: int, columns: tuple[int, ...]) -> Iterator[list[tuple[Any, ...]]]:
    """The rows of each page that has any, from the last page on: the newest first, mostly.

    Only rows of so many columns; the first column is the row's number. What cannot be read is left.
    """
    with path.open("rb") as file:
        pages = path.stat().st_size // page_size
        for number in range(pages, 0, -1):
            page = _page(file, number, page_size)
            if found := list(_rows(file, page, number, columns)):
                yield found


def _page(file: IO[bytes], number: int, size: int) -> bytes:
    file.seek((number - 1) * size)
    return file.read(size)


def _rows(
    file: IO[bytes], page: bytes, number: int, columns: tuple[int, ...]
) -> Iterator[tuple[Any, ...]]:
    at = _FIRST_PAGE_HEADER if number == 1 else 0
    if page[at] != _LEAF_OF_TABLE:
        return
    cells = int.from_bytes(page[at + 3 : at + 5], "big")
    for index in range(cells):
        pointer = at + _HEADER + 2 * index
        cell = int.from_bytes(page[pointer : pointer + 2], "big")
        try:
            yield _row(file, page, cell, columns)
        except (_Broken, IndexError, UnicodeDecodeError):
            continue


def _row(file: IO[bytes], page: bytes, at: int, columns: tuple[int, ...]) -> tuple[Any, ...]:
    length, at = _varint(page, at)
    number, at = _varint(page, at)
    payload = _payload(file, page, at, length)
    header, at = _varint(payload, 0)
    kinds = []
    while at < header:
        kind, at = _varint(payload, at)
        kinds.append(kind)
    if len(kinds) not in columns:
        raise _Broken("another table's")
    values: list[Any] = []
    for kind in kinds:
        value, at = _value(payload, at, kind)
        values.append(value)
    return (number, *values[1:])


def _payload(file: IO[bytes], page: bytes, at: int, length: int) -> bytes:
    """What stands on the page, and the pages that it goes on on."""
    size = len(page)
    if length <= size - 35:
        return page[at : at + length]
    if length > _MAX_PAYLOAD:
        raise _Broken("longer than any row")
    least = (size - 12) * 32 // 255 - 23
    here = least + (length - least) % (size - 4)
    here = here if here <= size - 35 else least
    found = bytearray(page[at : at + here])
    following = int.from_bytes(page[at + here : at + here + 4], "big")
    while len(found) < length:
        more = _page(file, following, size) if following else b""
        if len(more) < size:
            raise _Broken("goes on where nothing is")
        following = int.from_bytes(more[:4], "big")
        found += more[4 : 4 + length - len(found)]
    return bytes(found)


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """A number of up to nine bytes, and where it ends."""
    value = 0
    for index in range(8):
        byte = data[at + index]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + index + 1
    return value << 8 | data[at + 8], at + 9


def _value(data: bytes, at: int, kind: int) -> tuple[Any, int]:
    """A value of a record by its serial type, and where it ends; of numbers, whole ones alone."""
    if kind == 0:
        return None, at
    if kind in (8, 9):
        return kind - 8, at
    if kind < len(_INT_BYTES):
        end = at + _INT_BYTES[kind]
        return int.from_bytes(data[at:end], "big", signed=True), end
    if kind < 12:
        raise _Broken("no kind of ours")
    end = at + (kind - 12) // 2
    if end > len(data):
        raise _Broken("shorter than it says")
    return (data[at:end].decode() if kind % 2 else data[at:end]), end
