"""The bridge's log: a line for people, or a JSON object a line for a log collector."""

from __future__ import annotations

import json
import logging
import re
import sys
import time
from collections import Counter
from collections.abc import Hashable
from datetime import UTC, datetime
from typing import Final

from lupin_bridge.rate_limit import RateLimit

# Of a repeated message: so many at once of our own, and one a period from then on.
AT_ONCE: Final = 20
PERIOD_S: Final = 5.0
# Of all that one logger says.
LOGGER_AT_ONCE: Final = 200
LOGGER_PERIOD_S: Final = 0.2
MAX_KINDS: Final = 1_000

_NUMBER: Final = re.compile(r"(?:0x)?[0-9a-f]*[0-9][0-9a-f]*", re.IGNORECASE)

# uvicorn's words, with a trace of no use: the bytes were a stranger's.
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
    """Lets few records of a kind through, and not too many of one logger, whatever their kinds.

    Any stranger can cause some of them as often as he likes, and a disk is soon full. A kind is
    what a record says without its numbers (addresses, sizes, ids), and of its lines the first.
    """

    def __init__(self) -> None:
        super().__init__()
        self._ours = RateLimit(1.0 / PERIOD_S, AT_ONCE, MAX_KINDS)
        self._libraries = RateLimit(1.0 / PERIOD_S, 1, MAX_KINDS)
        self._loggers = RateLimit(1.0 / LOGGER_PERIOD_S, LOGGER_AT_ONCE, MAX_KINDS)
        self._held_back: Counter[Hashable] = Counter()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether to write the record; what it says of those before it is added."""
        now_s = time.monotonic()
        text = record.getMessage() if record.msg == "%s" else str(record.msg)
        error = record.exc_info[0] if record.exc_info else None
        kind = (record.name, record.levelno, _NUMBER.sub("#", text[:200].partition("\n")[0]), error)
        kinds = self._ours if is_ours(record.name) else self._libraries
        if kinds.take(kind, now_s) or self._loggers.take(record.name, now_s):
            if len(self._held_back) < MAX_KINDS:
                self._held_back[kind] += 1
            return False
        held_back = self._held_back.pop(kind, 0)
        if record.msg == _NO_TEXT:
            record.exc_info = record.exc_text = None
        if held_back:
            record.msg = f"{record.msg} ({held_back} more since the last time)"
        return True


def is_ours(logger: str) -> bool:
    """Whether a logger is the project's; a library's errors come with a page of trace each."""
    return logger.startswith("lupin")


def set_up(log_format: str, level: str = "info") -> None:
    """Send the log to standard error in this format, from this level on."""
    least = logging.getLevelNamesMapping()[level.upper()]
    handler = logging.StreamHandler(sys.stderr)
    # What ROS's nodes log passes no logger of ours, but this.
    handler.setLevel(least)
    # Here, and not at the root logger: what passes through others does not meet its filters.
    handler.addFilter(OnceInAWhile())
    if log_format == "json":
        handler.setFormatter(JsonFormatter())
    else:
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.root.addHandler(handler)
    # The libraries' debugging is not the bridge's: a line for each byte.
    logging.root.setLevel(max(least, logging.INFO))
    for ours in ("lupin_bridge", "lupin_twin"):
        logging.getLogger(ours).setLevel(least)
    # Its news (started, waiting, connection open) are logged here, once.
    logging.getLogger("uvicorn").setLevel(max(least, logging.WARNING))
