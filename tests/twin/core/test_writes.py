import pytest

from lupin_twin.core.past import MAX_WRITES, PastRefused, WritesRequest


def test_limits_are_allowed() -> None:
    WritesRequest(after=0, reach_s=1e9, reach_count=0, max_count=MAX_WRITES)
    WritesRequest(max_count=1, after=2**63 - 1)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"reach_s": -0.1}, "reach_s is -0.1"),
        ({"reach_s": 1.1e9}, "reach_s is 1100000000"),
        ({"reach_s": float("nan")}, "reach_s is nan"),
        ({"after": 2**63}, "after is 9223372036854775808, the limit is 9223372036854775807"),
        ({"max_count": 0}, "max_count is 0"),
        ({"max_count": MAX_WRITES + 1}, f"max_count is {MAX_WRITES + 1}"),
    ],
)
def test_what_cannot_be_is_refused(wrong: dict[str, int], says: str) -> None:
    with pytest.raises(PastRefused, match=says):
        WritesRequest(**wrong)
