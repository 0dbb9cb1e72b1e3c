"""Many looks at flowers at once: `packing.unpack_shape`, for all that are packed alike.

Looks at one crop differ in their numbers alone: the species, and which of how many flowers are odd,
are the same bytes in many of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import cycle, repeat
from typing import Final

import numpy as np
from numpy.typing import NDArray

from lupin_twin.journal.columns import Packed, unpacked
from lupin_twin.journal.packing import Damaged, ShapeKind, shape_kind, unpack_shape
from lupin_twin.making import make_many
from lupin_twin.state import Bloom, Flower

# So many kinds of looks of one length are unpacked together; those of others one by one.
_MAX_KINDS: Final = 8

Told = Sequence[Sequence[int]]  # species, anomaly, number of flowers, number of bugs: of each look


def unpack_flowers(sealed: Packed, told: Told, species_of: Callable[[int], str]) -> list[Flower]:
    """What was seen at each look; `sealed` are their shapes, whole, with their checks behind."""
    flowers: list[Flower | None] = [None] * len(told)
    for of_length, shapes_of_length in sealed.by_length():
        rows, shapes = of_length, shapes_of_length
        for _ in range(_MAX_KINDS):
            if not len(rows):
                break
            kind = shape_kind(shapes[0, :-2].tobytes())
            alike = (shapes[:, : kind.start] == shapes[0, : kind.start]).all(axis=1)
            some = rows[alike].tolist()
            made = _alike(shapes[alike], kind, [told[row] for row in some], species_of)
            for row, flower in zip(some, made, strict=True):
                flowers[row] = flower
            rows, shapes = rows[~alike], shapes[~alike]
        for row, shape in zip(rows.tolist(), shapes, strict=True):
            confidence, blooms, footprint = unpack_shape(shape[:-2].tobytes())
            species, anomaly, count, bugs = told[row]
            flowers[row] = Flower(
                species_of(species), confidence, bool(anomaly), count, bugs, blooms, footprint
            )
    return [flower for flower in flowers if flower is not None]


def _alike(
    shapes: NDArray[np.uint8], kind: ShapeKind, told: Told, species_of: Callable[[int], str]
) -> list[Flower]:
    numbers = unpacked(shapes[:, kind.start :], kind.numbers)
    if numbers is None:
        raise Damaged(f"{shapes.shape[1]} bytes are no look at {len(kind.marks)} flowers")
    count, flowers = len(shapes), len(kind.marks)
    blooms: Iterable[tuple[Bloom, ...]] = repeat((), count)
    if flowers:
        x, y, z, height, sure = numbers[:, 1 : 1 + 5 * flowers].reshape(-1, 5).T.tolist()
        odd, species = zip(*kind.marks, strict=True)
        made = make_many(
            Bloom, count * flowers, x, y, z, height, cycle(species), sure, cycle(map(bool, odd))
        )
        blooms = zip(*[iter(made)] * flowers, strict=True)
    footprints: Iterable[tuple[object, ...]] = repeat((), count)
    if kind.corners:
        corners = map(tuple, numbers[:, 1 + 5 * flowers :].reshape(-1, 3).tolist())
        footprints = zip(*[corners] * kind.corners, strict=True)
    what, anomaly, flower_counts, bug_counts = zip(*told, strict=True)
    names = {number: species_of(number) for number in set(what)}
    return make_many(
        Flower,
        count,
        map(names.__getitem__, what),
        numbers[:, 0].tolist(),
        map(bool, anomaly),
        flower_counts,
        bug_counts,
        blooms,
        footprints,
    )
