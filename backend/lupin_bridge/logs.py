"""The bridge's log: a line for people, or a JSON object a line for a log collector."""

from __future__ import annotations

import json
import logging
import sys
import time
from datetime import UTC, datetime
from typing import Final

from lupin_twin.throttle import Throttle

TEXT: Final = "text"
JSON: Final = "json"
FORMATS: Final = (TEXT, JSON)
LEVELS: Final = ("debug", "info", "warning", "error")

WEB_SERVER_PERIOD_S: Final = 5.0

# uvicorn's words, with a trace that tells nothing: the bytes were a stranger's.
_NO_TEXT: Final = "Invalid UTF-8 sequence received from client."


class JsonFormatter(logging.Formatter):
    """One JSON object a record: time (UTC), level, logger, message, and the error if any."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as one line."""
        fields = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            fields["error"] = self.formatException(record.exc_info)
        return json.dumps(fields, ensure_ascii=False)


class OnceInAWhile(logging.Filter):
    """Lets a record through if none like it has come for `WEB_SERVER_PERIOD_S`.

    For the web server's, some of which any stranger can cause as often as he likes.
    """

    def __init__(self) -> None:
        super().__init__()
        self._throttle = Throttle(WEB_SERVER_PERIOD_S)

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether to write the record; what it says of those before it is added."""
        error = record.exc_info[0] if record.exc_info else None
        held_back = self._throttle.ask((record.msg, error), time.monotonic())
        if held_back is None:
            return False
        if record.msg == _NO_TEXT:
            record.exc_info = None
        if held_back:
            record.msg = f"{record.msg} ({held_back} more since the last time)"
        return True


def set_up(log_format: str, level: str = "info") -> None:
    """Send the log to standard error in this format, from this level on."""
    least = logging.getLevelNamesMapping()[level.upper()]
    handler = logging.StreamHandler(sys.stderr)
    # What ROS's nodes log passes no logger of ours, but this.
    handler.setLevel(least)
    if log_format == JSON:
        handler.setFormatter(JsonFormatter())
    else:
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.root.addHandler(handler)
    # The libraries' debugging is not the bridge's: a line for each byte.
    logging.root.setLevel(max(least, logging.INFO))
    for ours in ("lupin_bridge", "lupin_twin"):
        logging.getLogger(ours).setLevel(least)
    # Its news (started, waiting, connection open) are ours to tell, once.
    logging.getLogger("uvicorn").setLevel(max(least, logging.WARNING))
    logging.getLogger("uvicorn.error").addFilter(OnceInAWhile())
