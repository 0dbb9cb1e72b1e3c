"""Rollups of one series, many hours at once: one by one, those of a year take 20 ms."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from lupin_twin.journal.columns import Ints, Packed, fetch
from lupin_twin.journal.packing import Bucket

# As `packing.pack_buckets` packs a sensor, by the bytes that it takes.
_LAYOUTS: Final = {
    kind.itemsize: kind
    for kind in (
        np.dtype([("n", count), ("mean", "<f8"), ("low", ends), ("high", ends)])
        for count in ("<u2", "<u4")
        for ends in ("<f4", "<f8")
    )
}

Floats = NDArray[np.float64]


def merged_hours(
    connection: sqlite3.Connection,
    series: int,
    hours: tuple[int, int],
    *,
    sensors: int,
    places: Sequence[int],
    width: int,
    origin: int,
) -> Iterator[tuple[int, Bucket]]:
    """(index, bucket) of the rollups of some hours, first to before last, `width` hours a bucket.

    Bucket 0 begins at the hour `origin`, or with the first hour if that is earlier. Told are the
    sensors at `places` of the series' `sensors`, all together. An hour that is damaged is left out.
    """
    found = fetch(
        connection,
        ("hour",),
        ("buckets",),
        "FROM rollup WHERE series = ? AND hour >= ? AND hour < ?",
        (series, *hours),
    )
    if not len(found):
        return
    index = (np.maximum(found.numbers[0], origin) - origin) // width
    order = np.argsort(index, kind="stable")
    told, starts, which = np.unique(index[order], return_index=True, return_inverse=True)
    n, mean, low, high = (of[order] for of in _unpacked(found.packed[0], sensors, places))
    # What is damaged, or beyond any number, is told as it is.
    with np.errstate(all="ignore"):
        counts = np.add.reduceat(n.sum(axis=1), starts)
        # Hour by hour, as `Bucket` would: pairs would give another last digit.
        means = np.bincount(np.repeat(which, len(places)), weights=(n * mean).ravel()) / counts
        lows = np.fmin.reduceat(np.fmin.reduce(low, axis=1, initial=np.inf), starts)
        highs = np.fmax.reduceat(np.fmax.reduce(high, axis=1, initial=-np.inf), starts)
    columns = (told, counts, means, lows, highs)
    for at, count, *rest in zip(*(column.tolist() for column in columns), strict=True):
        if count:
            yield at, Bucket(count, *rest)


def _unpacked(
    packed: Packed, sensors: int, places: Sequence[int]
) -> tuple[Ints, Floats, Floats, Floats]:
    """(n, mean, low, high), a row an hour, a column each of the places; none where damaged.

    `packing.unpack_buckets` for many.
    """
    shape = (len(packed.lengths), len(places))
    n = np.zeros(shape, dtype=np.int64)
    mean, low, high = np.zeros(shape), np.full(shape, np.inf), np.full(shape, -np.inf)
    data = np.frombuffer(packed.data, dtype=np.uint8)
    starts = np.cumsum(packed.lengths) - packed.lengths
    for each, layout in _LAYOUTS.items():
        rows = np.flatnonzero(packed.lengths == each * sensors)
        if not len(rows):
            continue
        # Of a row no more than what is told of it: the rest would be most of the time.
        where = starts[rows][:, None] + np.array(places) * each
        told = data[where[:, :, None] + np.arange(each)].view(layout)[:, :, 0]
        with np.errstate(invalid="ignore"):  # what is damaged may be a signalling NaN
            for name, column in (("n", n), ("mean", mean), ("low", low), ("high", high)):
                column[rows] = told[name]
    return n, mean, low, high
