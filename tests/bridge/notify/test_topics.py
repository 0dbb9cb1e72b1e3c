"""Any name becomes a safe part of a topic, and no two become the same."""

import re

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.notify.messages import MAX_PLAIN, Topics, safe


def test_a_name_is_used_whole_up_to_the_limit_and_past_it_by_a_digest() -> None:
    assert safe("x" * MAX_PLAIN) == "x" * MAX_PLAIN
    long = safe("x" * (MAX_PLAIN + 1))
    assert long.startswith("x" * 24 + "__")
    assert len(long) == 24 + 2 + 32
    assert long != safe("x" * MAX_PLAIN + "y")
    assert "_-_" not in long


@given(st.text(), st.text())
def test_no_two_names_have_the_same_part(one: str, other: str) -> None:
    assert (safe(one) == safe(other)) is (one == other)
    assert re.fullmatch(r"[A-Za-z0-9_-]{1,64}", safe(one))
    # The separator between a prefix and what is announced below it.
    assert "_-" not in safe(one)


@given(st.text(alphabet="/+#_ éx", min_size=20, max_size=80))
def test_long_unusual_names_are_cut_between_characters(name: str) -> None:
    assert re.fullmatch(r"(?:[A-Za-z0-9-]|_[0-9A-F]{2})*(?:__[0-9a-f]{32})?", safe(name))


def test_topics_start_with_the_prefix() -> None:
    topics = Topics("farm/gh1", "homeassistant")
    assert topics.status == "farm/gh1/status"
    assert topics.birth == "homeassistant/status"
    assert topics.of(None, "health") == "farm/gh1/house/health"
    assert topics.of("a/b", "alarms") == "farm/gh1/tags/a_2Fb/alarms"
    assert topics.reading("12", "co2") == "farm/gh1/tags/12/readings/co2"
    assert topics.config("sensor", "12", "verdict") == (
        "homeassistant/sensor/farm_2Fgh1/tag_12_-_verdict/config"
    )


def test_a_tag_called_house_is_not_the_greenhouse() -> None:
    topics = Topics("p", "d")
    assert topics.device("house") != topics.device(None)
    assert topics.of("house", "health") != topics.of(None, "health")
    assert topics.config("sensor", "house", "x") != topics.config("sensor", None, "x")
