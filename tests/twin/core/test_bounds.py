"""What is past a bound is refused by name, with its number and the limit."""

from __future__ import annotations

import pytest

from lupin_twin.core.drops import MAX_TEXT_LENGTH, Rejected, check_length, check_texts


def test_a_text_may_be_as_long_as_the_limit() -> None:
    check_texts("", "x" * MAX_TEXT_LENGTH)
    with pytest.raises(Rejected, match=r"^text 'x{24}'… has 257 characters, the limit is 256$"):
        check_texts("", "x" * (MAX_TEXT_LENGTH + 1))


def test_there_may_be_as_many_as_the_limit() -> None:
    check_length("tags", 3, 3)
    with pytest.raises(Rejected, match=r"^tags: 4, the limit is 3$"):
        check_length("tags", 4, 3)
