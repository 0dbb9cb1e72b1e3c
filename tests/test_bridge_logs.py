"""The log as lines for people and as JSON for collectors."""

from __future__ import annotations

import json
import logging

import pytest

from lupin_bridge import logs


@pytest.fixture(autouse=True)
def untouched_root(monkeypatch: pytest.MonkeyPatch) -> None:
    """`set_up` works on the root logger, which the test run has set up for itself."""
    monkeypatch.setattr(logging.root, "handlers", [])
    monkeypatch.setattr(logging.root, "level", logging.WARNING)


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


def test_the_web_servers_own_news_stay_out(capsys: pytest.CaptureFixture[str]) -> None:
    logs.set_up(logs.TEXT)
    logging.getLogger("uvicorn.error").info("Started server process")
    logging.getLogger("uvicorn.error").warning("something is wrong")
    assert capsys.readouterr().err.count("\n") == 1
