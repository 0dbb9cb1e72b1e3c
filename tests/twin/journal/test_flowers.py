from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.journal.columns import Packed
from lupin_twin.journal.flowers import unpack_flowers
from lupin_twin.journal.packing import pack_shape, seal
from lupin_twin.state import Bloom, Flower

NUMBERS = st.sampled_from([0.5, 0.1, -1.0, float("nan")])
SPECIES = ("", "lupin", "rose")
blooms = st.builds(Bloom, *[NUMBERS] * 4, st.sampled_from(SPECIES), NUMBERS, st.booleans())
flowers = st.builds(
    Flower,
    st.sampled_from(SPECIES),
    NUMBERS,
    st.booleans(),
    st.integers(0, 65_535),
    st.integers(0, 65_535),
    st.lists(blooms, max_size=3).map(tuple),
    st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), max_size=2).map(tuple),
)


@given(st.lists(flowers, max_size=30))
def test_many_looks_are_what_they_would_be_one_by_one(looks: list[Flower]) -> None:
    shapes = [seal(b"", pack_shape(flower)) for flower in looks]
    packed = Packed(b"".join(shapes), np.array([len(each) for each in shapes], dtype=np.int64))
    told = [
        (SPECIES.index(each.species), int(each.anomaly), each.flower_count, each.bug_count)
        for each in looks
    ]
    found = unpack_flowers(packed, told, SPECIES.__getitem__)
    assert list(map(repr, found)) == list(map(repr, looks))
