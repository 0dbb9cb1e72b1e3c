from collections.abc import Sequence

from lupin_bridge.judge.judging import NOTHING_JUDGED, Judge, Judged, silenced
from lupin_bridge.stream import schema
from lupin_bridge.stream.state_json import judgement
from lupin_twin.core.state import Reading, Snapshot, TagState
from tests.support.seen import BY_LIGHT

START = 1_000_000_000_000


def see(judge: Judge, at_ns: int, tags: Sequence[TagState]) -> Judged:
    return judge.see(Snapshot(at_ns, "map", tuple(tags)))


def tag(tag_id: str, value: float, at_ns: int = START) -> TagState:
    return TagState(tag_id, readings=(Reading("temperature", value, at_ns),))


def test_a_value_held_only_by_the_deadband_has_its_limit_and_what_clears_it() -> None:
    """From 18 to 26 °C the deadband is 0.4."""
    judge = Judge(BY_LIGHT)
    see(judge, START, [tag("a", 17.9)])
    text = judgement(see(judge, START + 1, [tag("a", 18.1, START + 1)]))
    (reason,) = schema.Judgement.model_validate_json(text, strict=True).tags["a"].reasons
    assert (reason.limit, reason.release) == (18.0, 18.4)


def test_a_silent_greenhouse_is_reported_as_silent() -> None:
    judged = silenced(see(Judge(BY_LIGHT), START, [tag("a", 22.0)]))
    body = schema.Judgement.model_validate_json(judgement(judged), strict=True)
    assert (body.house.verdict, body.house.reasons[0].kind) == ("unknown", "silent")
    assert body.tags["a"].verdict == "healthy"


def test_a_greenhouse_not_judged_yet_is_reported_too() -> None:
    body = schema.Judgement.model_validate_json(judgement(NOTHING_JUDGED), strict=True)
    assert (body.house.verdict, body.tags) == ("unknown", {})
