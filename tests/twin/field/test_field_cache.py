"""The cache of fields: what it stores, what it evicts, what it counts."""

from lupin_twin.field.engine import MAX_ENTRIES, FieldCache, FieldKey, FieldRequest, FieldRules
from lupin_twin.field.grid import FieldGrid
from lupin_twin.field.idw import compute_idw_field

RULES = FieldRules(2.0, 1.5, 1.5, 1_000, clip_to_explored=False)


def key(number: int) -> FieldKey:
    """A key that differs from any other by its box."""
    request = FieldRequest("temperature", 1.0, float(number), 0.0, number + 5.0, 5.0)
    return FieldKey(request, observation_count=3, map_revision=None, rules=RULES)


def grid(cells: int) -> FieldGrid:
    """A field of one row: 4 bytes a cell."""
    return compute_idw_field(
        [],
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=float(cells),
        bbox_max_y=1.0,
        resolution=1.0,
        falloff_radius_m=1.0,
        max_distance_m=1.0,
        power=2.0,
    )


def test_64_fields_are_cached_and_the_least_recently_used_goes_first() -> None:
    cache = FieldCache(1e6)
    for number in range(MAX_ENTRIES):
        cache.put(key(number), grid(1))
    assert cache.get(key(0)) is not None
    cache.put(key(100), grid(1))
    assert MAX_ENTRIES == 64
    assert len(cache) == 64
    assert cache.get(key(0)) is not None
    assert cache.get(key(1)) is None
    assert cache.get(key(2)) is not None


def test_the_total_bytes_are_limited() -> None:
    cache = FieldCache(100)
    for number in range(5):
        cache.put(key(number), grid(10))
    assert (cache.bytes, len(cache)) == (80, 2)
    assert cache.get(key(3)) is not None
    assert cache.get(key(4)) is not None
    cache.put(key(5), grid(25))
    assert (cache.bytes, len(cache)) == (100, 1)


def test_a_field_larger_than_the_cache_is_not_cached_and_evicts_nothing() -> None:
    cache = FieldCache(100)
    cache.put(key(1), grid(10))
    cache.put(key(2), grid(26))
    assert cache.get(key(2)) is None
    assert cache.get(key(1)) is not None
    assert cache.bytes == 40
