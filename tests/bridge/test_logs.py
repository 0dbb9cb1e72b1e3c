"""The log as lines for people and as JSON for collectors."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Iterator

import pytest

from lupin_bridge import logs


@pytest.fixture(autouse=True)
def untouched_root(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """`set_up` works on the root logger, which the test run has set up for itself."""
    monkeypatch.setattr(logging.root, "handlers", [])
    monkeypatch.setattr(logging.root, "level", logging.WARNING)
    monkeypatch.setattr(logging.getLogger("uvicorn.error"), "filters", [])
    yield
    for name in ("lupin_bridge", "lupin_twin"):
        logging.getLogger(name).setLevel(logging.NOTSET)


def test_json_is_one_object_a_line_with_the_error(capsys: pytest.CaptureFixture[str]) -> None:
    logs.set_up(logs.JSON)
    log = logging.getLogger("lupin_bridge.test")
    log.info("tag %s\nsecond line", "7°")
    log.error("failed", exc_info=ValueError("broken"))
    first, second = (json.loads(line) for line in capsys.readouterr().err.splitlines())
    assert first["message"] == "tag 7°\nsecond line"
    assert (first["level"], first["logger"]) == ("info", "lupin_bridge.test")
    assert first["time"].endswith("+00:00")
    assert "error" not in first
    assert second["error"].endswith("ValueError: broken")


def test_text_is_a_line_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    logs.set_up(logs.TEXT)
    logging.getLogger("lupin_bridge.test").warning("hello")
    assert capsys.readouterr().err.endswith(" WARNING lupin_bridge.test: hello\n")


@pytest.mark.parametrize("level", logs.LEVELS)
def test_what_is_below_the_level_stays_out(level: str, capsys: pytest.CaptureFixture[str]) -> None:
    logs.set_up(logs.TEXT, level)
    for least in logs.LEVELS:
        logging.getLogger("lupin_bridge.test").log(getattr(logging, least.upper()), "ours")
        # As the nodes' lines come: past every logger.
        record = logging.LogRecord("ros", getattr(logging, least.upper()), "", 0, "ros", (), None)
        logging.root.handle(record)
        logging.getLogger("asyncio").debug("a library's")
    said = capsys.readouterr().err
    expected = len(logs.LEVELS) - logs.LEVELS.index(level)
    assert (said.count(": ours"), said.count(": ros")) == (expected, expected)
    assert "library" not in said


def test_the_web_servers_own_news_stay_out(capsys: pytest.CaptureFixture[str]) -> None:
    logs.set_up(logs.TEXT)
    logging.getLogger("uvicorn.error").info("Started server process")
    logging.getLogger("uvicorn.error").warning("something is wrong")
    assert capsys.readouterr().err.count("\n") == 1


def test_what_strangers_cause_is_logged_once_in_a_while(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    logs.set_up(logs.TEXT)
    web_server = logging.getLogger("uvicorn.error")
    for _ in range(1_000):
        web_server.warning("Invalid HTTP request received.")
    web_server.warning("%s is another matter", "this")
    now_s[0] += logs.WEB_SERVER_PERIOD_S
    web_server.warning("Invalid HTTP request received.")
    said = [line.partition(": ")[2] for line in capsys.readouterr().err.splitlines()]
    assert said == [
        "Invalid HTTP request received.",
        "this is another matter",
        "Invalid HTTP request received. (999 more since the last time)",
    ]


def test_each_of_our_own_errors_leaves_its_trace_and_a_strangers_bytes_leave_none(
    capsys: pytest.CaptureFixture[str],
) -> None:
    logs.set_up(logs.TEXT)
    web_server = logging.getLogger("uvicorn.error")
    for error in (ValueError("ours"), KeyError("ours too")):
        web_server.error("Exception in ASGI application", exc_info=error)
    no_text = UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid")
    web_server.error("Invalid UTF-8 sequence received from client.", exc_info=no_text)
    err = capsys.readouterr().err
    assert "ValueError: ours" in err
    assert "KeyError: 'ours too'" in err
    assert "Invalid UTF-8" in err
    assert "UnicodeDecodeError" not in err
