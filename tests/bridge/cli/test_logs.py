"""The log as lines for people and as JSON for collectors."""

import json
import logging
import time
from collections.abc import Iterator

import pytest

from lupin_bridge.cli import command

LEVELS = ["debug", "info", "warning", "error"]


@pytest.fixture(autouse=True)
def untouched_root(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """`set_up` works on the root logger, which the test run has set up for itself."""
    monkeypatch.setattr(logging.root, "handlers", [])
    monkeypatch.setattr(logging.root, "level", logging.WARNING)
    yield
    for name in ("lupin_bridge", "lupin_twin"):
        logging.getLogger(name).setLevel(logging.NOTSET)


def test_json_is_one_object_a_line_with_the_error(capsys: pytest.CaptureFixture[str]) -> None:
    command.set_up_log("json")
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
    command.set_up_log("text")
    logging.getLogger("lupin_bridge.test").warning("hello")
    assert capsys.readouterr().err.endswith(" WARNING lupin_bridge.test: hello\n")


@pytest.mark.parametrize("level", LEVELS)
def test_what_is_below_the_level_stays_out(level: str, capsys: pytest.CaptureFixture[str]) -> None:
    command.set_up_log("text", level)
    for least in LEVELS:
        logging.getLogger("lupin_bridge.test").log(getattr(logging, least.upper()), "ours")
        # As the nodes' lines come: past every logger.
        record = logging.LogRecord("ros", getattr(logging, least.upper()), "", 0, "ros", (), None)
        logging.root.handle(record)
        logging.getLogger("asyncio").debug("a library's")
    said = capsys.readouterr().err
    expected = len(LEVELS) - LEVELS.index(level)
    assert (said.count(": ours"), said.count(": ros")) == (expected, expected)
    assert "library" not in said


def test_the_web_servers_own_news_stay_out(capsys: pytest.CaptureFixture[str]) -> None:
    command.set_up_log("text")
    logging.getLogger("uvicorn.error").info("Started server process")
    logging.getLogger("uvicorn.error").warning("something is wrong")
    assert capsys.readouterr().err.count("\n") == 1


def test_what_strangers_cause_is_logged_once_in_a_while(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    command.set_up_log("text")
    web_server = logging.getLogger("uvicorn.error")
    for _ in range(1_000):
        web_server.warning("Invalid HTTP request received.")
    web_server.warning("%s is another matter", "this")
    now_s[0] += command.PERIOD_S
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
    command.set_up_log("text")
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


def said_by(name: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What a logger has said so far, line by line."""
    lines = capsys.readouterr().err.splitlines()
    return [line.partition(f" {name}: ")[2] for line in lines if f" {name}: " in line]


@pytest.mark.parametrize("name", ["lupin_bridge.access", "lupin_twin", "lupin_web"])
def test_of_our_own_some_are_said_at_once(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    command.set_up_log("text")
    log = logging.getLogger(name)
    for number in range(command.AT_ONCE + 7):
        log.warning("wrong token from %s", f"10.0.0.{number}")
    log.warning("something else")
    assert len(said_by(name, capsys)) == command.AT_ONCE + 1
    now_s[0] += command.PERIOD_S
    log.warning("wrong token from %s", "10.0.0.9")
    log.warning("wrong token from %s", "10.0.0.9")
    assert said_by(name, capsys) == ["wrong token from 10.0.0.9 (7 more since the last time)"]


@pytest.mark.parametrize("name", ["asyncio", "uvicorn.error", "websockets.server", "nobodys"])
def test_every_librarys_traces_are_rationed_whatever_numbers_stand_in_them(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command.set_up_log("text")
    for number in range(1_000):
        text = f"Fatal error on <Transport fd={number} at {number * 7919:#x}>\nprotocol: {number}"
        logging.getLogger(name).error(text, exc_info=ValueError(str(number)))
    assert capsys.readouterr().err.count("ValueError") == 1


def test_one_logger_has_an_end_whatever_it_thinks_of(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(time, "monotonic", lambda: 100.0)
    command.set_up_log("text")
    for number in range(10 * command.LOGGER_AT_ONCE):
        logging.getLogger("lupin_twin").warning("%s", "x" * number)
    logging.getLogger("lupin_bridge").warning("is heard")
    err = capsys.readouterr().err
    assert err.count(" lupin_twin: ") == command.LOGGER_AT_ONCE
    assert "is heard" in err
