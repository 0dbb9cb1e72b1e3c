"""The memo of computed fields: the least recently used goes first, within two bounds.

Pure: it holds immutable grids under hashable keys and has no lock; it belongs to one thread.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from typing import Final, NamedTuple

from lupin_twin.grid import FieldGrid

MAX_ENTRIES: Final = 64
MAX_BYTES: Final = 64_000_000


class FieldKey(NamedTuple):
    """Everything that a field depends on; `rules` are those by which it is made.

    `observation_count` stands for the store's whole content. `map_revision` is None where no map
    has come.
    """

    sensor_type: str
    observation_count: int
    resolution: float
    bbox_min_x: float
    bbox_min_y: float
    bbox_max_x: float
    bbox_max_y: float
    map_revision: int | None
    rules: Hashable


class FieldCache:
    """An LRU of at most `max_entries` fields whose values take at most `max_bytes` together."""

    def __init__(self, max_bytes: int = MAX_BYTES, max_entries: int = MAX_ENTRIES) -> None:
        """Raises ValueError for a bound below 0."""
        if max_bytes < 0:
            raise ValueError(f"max_bytes is {max_bytes}, must not be less than 0")
        if max_entries < 0:
            raise ValueError(f"max_entries is {max_entries}, must not be less than 0")
        self.max_bytes = max_bytes
        self.max_entries = max_entries
        self.hits = 0
        self.misses = 0
        self.bytes = 0
        self._grids: OrderedDict[FieldKey, FieldGrid] = OrderedDict()

    def __len__(self) -> int:
        return len(self._grids)

    def get(self, key: FieldKey) -> FieldGrid | None:
        """The field kept under `key`, which becomes the most recently used; counted either way."""
        grid = self._grids.get(key)
        if grid is None:
            self.misses += 1
            return None
        self._grids.move_to_end(key)
        self.hits += 1
        return grid

    def put(self, key: FieldKey, grid: FieldGrid) -> None:
        """Keep `grid`, dropping the least recently used; one past the whole bound is not kept."""
        if grid.values.nbytes > self.max_bytes:
            return
        replaced = self._grids.pop(key, None)
        if replaced is not None:
            self.bytes -= replaced.values.nbytes
        self._grids[key] = grid
        self.bytes += grid.values.nbytes
        while len(self._grids) > self.max_entries or self.bytes > self.max_bytes:
            _, dropped = self._grids.popitem(last=False)
            self.bytes -= dropped.values.nbytes
