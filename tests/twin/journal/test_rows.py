from __future__ import annotations

from lupin_twin.journal.rows import weight
from tests.support.journal import look, pin, scan


def test_a_row_weighs_what_it_holds() -> None:
    assert weight(scan(temperature=1.0, humidity=2.0)) == 3
    assert weight(look()) == 1 + 2 + 3
    assert weight(pin()) == 1
