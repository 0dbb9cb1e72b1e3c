"""The state over WebSocket and HTTP, from a real twin that a real peer feeds."""

import re
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote

import pytest
from lupin_msgs.msg import Observation
from websockets.exceptions import ConnectionClosedError

from lupin_bridge.stream import schema
from tests.support.messages import discovered, look, pose, scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge, filled, tag_ids

# The twin itself publishes once in 100 s: what comes earlier was caused by a change, or is the
# bridge's own heartbeat, which changes no revision.
SILENT = ("--ros-args", "-p", "state_publish_rate_hz:=0.01", "-p", "buffer_len:=3")


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    """A bridge for many tests, each with tags of its own."""
    with bridge(*SILENT) as running:
        yield running


# --- WebSocket ----------------------------------------------------------------------------------


def test_a_late_joiner_gets_the_status_and_then_the_state_while_the_twin_is_silent(
    live: Bridge,
) -> None:
    with live.listen() as listener:
        live.peer.observe(scan("early", {"co2": 400.0}, at=(1, 2)))
        listener.until_tag("early")
    with live.listen() as late:
        status, state = late.next(), late.next()
    assert (status["type"], status["twin"], status["reason"]) == ("status", "live", "live")
    assert state["type"] == "state"
    assert "early" in tag_ids(state["state"])


def test_a_change_is_pushed_without_waiting_for_the_twins_next_publication(live: Bridge) -> None:
    with live.listen() as listener:
        listener.until("state")
        live.peer.observe(scan("pushed", {"co2": 500.0}, at=(1, 2)))
        listener.until_tag("pushed")
        live.peer.discover(discovered({"seen": pose(3, 3)}))
        listener.until_tag("seen")
        live.peer.observe(look("looked at", anomaly=True))
        listener.until_tag("looked at")


def test_seq_grows_and_the_revision_changes_with_what_could_change_a_field(live: Bridge) -> None:
    with live.listen() as listener:
        frames = [listener.until("state")]
        for number in range(3):
            live.peer.observe(scan(f"counted {number}", {"co2": 1.0}))
            frames.append(listener.until_tag(f"counted {number}"))
        heartbeat = listener.until("state", lambda frame: frame["seq"] > frames[-1]["seq"])
    numbers = [frame["seq"] for frame in frames]
    assert numbers == sorted(set(numbers))
    assert len({frame["revision"] for frame in frames}) == 4
    assert heartbeat["revision"] == frames[-1]["revision"]


def test_who_connects_again_goes_on_with_the_same_numbers(live: Bridge) -> None:
    with live.listen() as listener:
        first = listener.until("state")["seq"]
    with live.listen() as listener:
        assert listener.until("state")["seq"] >= first


def test_a_heartbeat_comes_although_nothing_changes_and_ages_grow(live: Bridge) -> None:
    live.peer.observe(scan("ageing", {"co2": 1.0}))
    live.tag("ageing")
    with live.listen() as listener:
        ages = []
        for _ in range(2):
            state = listener.until_tag("ageing")["state"]
            tag = next(tag for tag in state["tags"] if tag["tag_id"] == "ageing")
            ages.append(tag["stale_seconds"])
    assert ages == sorted(set(ages))


def test_who_asks_for_deltas_gets_the_state_once_and_then_what_changes(live: Bridge) -> None:
    with live.listen(delta=1) as listener:
        last = listener.until("state")["seq"]
        # What other tests have told may still be on its way when the first of them comes.
        for tag_id in ("ready", "changed"):
            live.peer.observe(scan(tag_id, {"co2": 1.0}))
            changed: list[str] = []
            while tag_id not in changed:
                delta = listener.next()
                if delta["type"] in ("alarms", "status"):
                    continue
                assert (delta["type"], delta["base"]) == ("delta", last)
                schema.DeltaFrame.model_validate(delta)
                last = delta["seq"]
                changed = [tag["tag_id"] for tag in delta["changed"]]
        assert changed == ["changed"]


def test_who_asks_for_fewer_frames_is_sent_fewer(live: Bridge) -> None:
    with live.listen(max_rate_hz=0.01) as rare, live.listen() as frequent:
        numbers = [rare.until("state")["seq"]]
        for number in range(4):
            live.peer.observe(scan(f"often {number}", {"co2": 1.0}))
            frequent.until_tag(f"often {number}")
        # The next is due in 100 s.
        numbers += [frame["seq"] for frame in rare.rest() if frame["type"] == "state"]
        assert len(numbers) == 1


def test_what_cannot_be_served_is_refused_with_the_reason(live: Bridge) -> None:
    for name in ("rate", "encoding"):
        with live.listen(**{name: "\U0001f337" * 40}) as refused:
            with pytest.raises(ConnectionClosedError) as closed:
                refused.next()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
            assert closed.value.rcvd.reason == (
                f"parameter {name!r} is unknown, expected delta, max_rate_hz"
            )


# --- /api/state ---------------------------------------------------------------------------------


def test_the_state_is_kept_by_nobody(live: Bridge) -> None:
    assert live.get("/api/state").headers["cache-control"] == "no-store"


# --- one tag ------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", ["/api/tags/nobody", "/api/tags/nobody/history"])
def test_a_tag_that_is_not_there_is_named_with_404(live: Bridge, path: str) -> None:
    known = len(live.json("/api/state")["tags"])
    answer = live.get(path)
    assert answer.status_code == 404
    message = schema.ErrorMessage.model_validate_json(answer.content)
    assert message.detail == f"no tag 'nobody' is known ({known} others are)"


@pytest.mark.parametrize(
    "tag_id",
    [
        "ä ö",
        "100%",
        "a?b=c#d",
        "<b>&amp;",
        "..",
        "日本",
        '"',
        "a\\b",
        "%2F",
        " ",
        "/",
        "../x",
        "x/1",
    ],
)
def test_any_tag_id_is_found_by_its_percent_encoded_name(live: Bridge, tag_id: str) -> None:
    live.peer.observe(scan(tag_id, {"co2": 1.0}))
    live.tag(tag_id)
    encoded = quote(tag_id, safe="").replace("..", "%2E%2E")
    assert live.json(f"/api/tags/{encoded}")["tag_id"] == tag_id
    assert live.json(f"/api/tags/{encoded}/history")["tag_id"] == tag_id


@pytest.mark.parametrize(
    "tag_id",
    ["%00", "%FF%FE", "%0d%0aSet-Cookie:x=1", "%3Cscript%3E", "x" * 4_000, "%F0%9F%8C%B7", "a%2Fb"],
)
def test_a_hostile_tag_id_is_a_plain_404(live: Bridge, tag_id: str) -> None:
    for path in (f"/api/tags/{tag_id}", f"/api/tags/{tag_id}/history"):
        answer = live.get(path)
        assert answer.status_code == 404
        assert len(schema.ErrorMessage.model_validate_json(answer.content).detail) < 400
        assert "set-cookie" not in answer.headers
        assert answer.headers["content-type"] == "application/json"


# --- history ------------------------------------------------------------------------------------


def history(live: Bridge, tag_id: str) -> dict[str, list[Any]]:
    """The past values of each sensor of a tag, oldest first."""
    sensors = live.json(f"/api/tags/{tag_id}/history")["sensors"]
    return {sensor["name"]: [v["value"] for v in sensor["values"]] for sensor in sensors}


def test_a_history_holds_the_last_scans_and_no_look(live: Bridge) -> None:
    for value in range(5):
        live.peer.observe(scan("past", {"co2": value}, stamp_s=100.0 + value))
    live.peer.observe(scan("past", {"light": 900.0}, stamp_s=110.0), look("past"))
    live.tag("past", lambda tag: tag["species"])
    expected = {"co2": [3.0, 4.0], "light": [900.0]}  # `buffer_len` is 3
    wait_for(lambda: history(live, "past") == expected, "all in the log")
    values = live.json("/api/tags/past/history")["sensors"][0]["values"]
    assert values[0]["stamp"] == {"sec": 103, "nanosec": 0}


def test_what_was_tried_and_when_what_was_observed_is_told(live: Bridge) -> None:
    """10 s: a scan; 3610 s: a look; 7210 s: a scan of light alone; 7300 s: a try that failed."""
    failed = scan("told", status=Observation.STATUS_SCAN_FAILED, stamp_s=7300.0)
    failed.status_detail = "not decoded"
    live.peer.observe(
        scan("told", {"co2": 400.0, "light": 1.0}, stamp_s=10.0),
        look("told", stamp_s=3610.0),
        scan("told", {"light": 2.0}, stamp_s=7210.0),
        failed,
        scan("told", {"light": 2.0}, stamp_s=7210.0),
    )
    tag = live.tag("told", lambda tag: bool(filled(tag)["last_try_status"]))
    assert [reading["observed_at"]["sec"] for reading in tag["readings"]] == [10, 7210]
    assert (tag["last_observed"]["sec"], tag["looked_at"]["sec"]) == (7210, 3610)
    assert (tag["last_try"]["sec"], tag["last_try_status"]) == (7300, 2)
    assert tag["last_try_detail"] == "not decoded"
    expected = {"co2": [400.0], "light": [1.0, 2.0]}
    wait_for(lambda: history(live, "told") == expected, "all in the log")
    past = live.json("/api/tags/told/history")
    assert [(each["stamp"]["sec"], each["status"], each["kind"]) for each in past["tries"]] == [
        (3610, 0, 1), (7210, 0, 0), (7300, 2, 0),
    ]  # fmt: skip
    assert past["tries"][-1]["status_detail"] == "not decoded"


def test_a_producer_whose_stamps_stay_behind_is_told_in_the_status_and_counted(
    live: Bridge,
) -> None:
    messages = [scan("late", {"co2": 1.0}, stamp_s=2000.0)]
    messages += [scan("late", {"co2": 2.0}, stamp_s=1400.0 + i) for i in range(8)]
    for message in messages:
        message.source = "stepped back"
    live.peer.observe(*messages)

    def late() -> int:
        drops = live.json("/readyz")["drops"]
        return sum(each["count"] for each in drops if "'stepped back'" in each["message"])

    # Other tests' robots go back in time too.
    wait_for(lambda: late() >= 8, "the late stamps")
    [counted] = re.findall(
        r'lupin_dropped\w*{reason="late_stamp"} (\S+)', live.get("/metrics").text
    )
    assert float(counted) >= 8


def test_a_tag_that_was_never_scanned_has_an_empty_history(live: Bridge) -> None:
    live.peer.discover(discovered({"unscanned": pose(1, 1)}))
    live.tag("unscanned")
    assert history(live, "unscanned") == {}
