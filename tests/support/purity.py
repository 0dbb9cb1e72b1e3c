"""What a module that calls itself pure may use."""

from __future__ import annotations

import re
from collections.abc import Mapping

# What a pure module may use of the standard library. Whatever is not named here (files, sockets,
# threads, clocks, databases) is the outside world.
PURE_STANDARD = frozenset(
    {
        "__future__",
        "array",
        "binascii",
        "bisect",
        "collections",
        "colorsys",
        "contextlib",
        "dataclasses",
        "enum",
        "fractions",
        "functools",
        "hashlib",
        "heapq",
        "hmac",
        "html",
        "io",
        "ipaddress",
        "itertools",
        "json",
        "math",
        "re",
        "statistics",
        "string",
        "struct",
        "types",
        "typing",
        "urllib.parse",
        "zlib",
    }
)
# And of libraries: what computes, and nothing that serves.
PURE_LIBRARIES = frozenset({"PIL", "numpy", "orjson", "pydantic", "websockets.frames"})
# A pure module that needs one thing more.
PURE_EXCEPT: Mapping[str, set[str]] = {
    "lupin_twin.idw": {"sys"},  # float_info
    # It has no ROS and does no input or output, but it is threads and order in time.
    "lupin_twin.workers": {"concurrent.futures", "threading", "time"},
    "lupin_twin.field_desk": {
        "concurrent.futures",
        "queue",
        "time",
    },  # where the workers' results come back
    "lupin_twin.resending": {"time", "warnings"},  # rclpy says it in a warning
    "lupin_twin.past_desk": {"concurrent.futures", "queue", "time"},
    "lupin_twin.leaving": {"logging", "os", "sys", "threading", "time"},  # the end of a process
    "lupin_twin.one_core": {"os"},  # what a process is told at its start
    "lupin_twin.stop_signals": {
        "ctypes",
        "faulthandler",
        "os",
        "signal",
        "sys",
    },  # which is what it is about
    # Values and errors of modules that do more than that.
    "lupin_bridge.access.credentials": {"lupin_bridge.settings.SettingError"},
    "lupin_bridge.past.moments": {"datetime"},  # the calendar
    "lupin_bridge.judge.daylight": {"datetime"},  # the calendar, not the clock
    "lupin_bridge.outward.deliveries": {"base64", "lupin_bridge.alarms.board.Change"},
    "lupin_bridge.outward.payloads": {"lupin_bridge.alarms.board.Board"},
}
CLAIMS_PURITY = re.compile(r"\bPure\b|No input or output")
