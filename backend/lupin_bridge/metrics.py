"""Prometheus metrics: gauges and counters are read at each scrape, durations are histograms."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

from prometheus_client import CollectorRegistry, Histogram, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

CONTENT_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"

# A metric's name, and its value; with a label, a value by label.
Sample = tuple[str, float | Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Described:
    """A metric's kind and help text; `label`: its label name, if it has one."""

    kind: Literal["gauge", "counter"]
    help: str
    label: str = ""


gauge = partial(Described, "gauge")
counter = partial(Described, "counter")
# By name; the output adds `_total` to a counter's, as Prometheus requires.
METRICS: Final = {
    "lupin_clients": gauge("WebSocket clients that follow the state"),
    "lupin_clients_blocked": gauge("clients whose socket accepts no data at the moment"),
    "lupin_ros_thread_alive": gauge("1 while the ROS thread runs"),
    "lupin_ros_calls_waiting": gauge("calls waiting for the ROS thread"),
    "lupin_twin_live": gauge("1 while the twin is live"),
    "lupin_twins": gauge("twins that publish the state; more than 1 is a fault"),
    "lupin_state_age_seconds": gauge("seconds since the last state arrived; infinite: none has"),
    "lupin_tags": gauge("tags that the twin knows"),
    "lupin_alarms_known": gauge("1 once past alarms are known"),
    "lupin_alarms_active": gauge("active alarms"),
    "lupin_fields_computing": gauge("field requests being computed now"),
    "lupin_journal_recording": gauge("1 while the journal records observations"),
    "lupin_journal_rows_waiting": gauge("observations not yet written to the journal"),
    "lupin_journal_behind_seconds": gauge("seconds that the oldest of those has waited"),
    "lupin_journal_file_bytes": gauge("size of the journal file on disk"),
    "lupin_outward_connected": gauge("1 while the receiving side accepts messages", "channel"),
    "lupin_outward_waiting": gauge(
        "changes of alarms not yet sent; MQTT: 0 if the broker has the current state", "channel"
    ),
    "lupin_clients_dismissed": counter(
        "clients disconnected because they accepted no frame for too long"
    ),
    "lupin_frames_sent": counter("state frames written to clients"),
    "lupin_frames_skipped": counter(
        "state frames not sent because a client was slow or asked for fewer"
    ),
    "lupin_bytes_sent": counter("bytes of frames written to clients"),
    "lupin_messages_sent": counter("ROS messages relayed to viewers unchanged"),
    "lupin_messages_skipped": counter(
        "ROS messages not relayed because a viewer was slow or the message too large"
    ),
    "lupin_alarms_missed": counter("observations received too late for the alarms they belong to"),
    "lupin_alarms_raised": counter("alarms raised since the start; past alarms are not counted"),
    "lupin_ros_callback_errors": counter("errors raised in ROS callbacks"),
    "lupin_judge_errors": counter(
        "states that could not be judged, which leaves every status unknown"
    ),
    "lupin_journal_rows": counter("observations written to the journal"),
    "lupin_journal_rows_lost": counter(
        "observations lost because the journal could not be written"
    ),
    "lupin_admission_refused": counter("requests refused, by the limit they exceeded", "reason"),
    "lupin_dropped": counter("messages and entries that the twin dropped or lost", "reason"),
    "lupin_web_dropped": counter("messages that `web` itself dropped or lost", "reason"),
    "lupin_http_answers": counter("HTTP answers of the routes, by status", "status"),
    "lupin_outward_sent": counter("messages that a broker or a receiver accepted", "channel"),
    "lupin_outward_failed": counter("connections and posts that failed", "channel"),
    "lupin_outward_dropped": counter("changes of alarms and messages given up", "channel"),
}
HISTOGRAMS: Final = {
    "lupin_push_seconds": (
        "time from a change in the ROS thread until the frame is written to every ready client"
    ),
    "lupin_field_seconds": "time until a field is computed and written",
    "lupin_http_seconds": "time from a request until its answer begins",
    "lupin_past_seconds": "time until a request about the past is answered, by its kind",
}

# From a millisecond to the time-out of a field.
_SECONDS: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)


class Metrics(Collector):
    """The bridge's metrics; `read` gives a sample of each gauge and counter at each scrape."""

    def __init__(self, read: Callable[[], Iterable[Sample]]) -> None:
        self._read = read
        self._registry = CollectorRegistry()
        self._registry.register(self)
        ProcessCollector(registry=self._registry)
        self.push_seconds = self._histogram("push")
        self.field_seconds = self._histogram("field")
        self.http_seconds = self._histogram("http", "route")
        self.past_seconds = self._histogram("past", "question")

    def describe(self) -> Iterable[Metric]:
        """Describe nothing, or the registry would collect at once, when nothing can be read yet."""
        return ()

    def collect(self) -> Iterator[Metric]:
        """The gauges and counters, for the registry."""
        for name, value in self._read():
            known = METRICS[name]
            kind = GaugeMetricFamily if known.kind == "gauge" else CounterMetricFamily
            if not isinstance(value, Mapping):
                yield kind(name, known.help, value)
                continue
            family = kind(name, known.help, labels=[known.label])
            for of, count in value.items():
                family.add_metric([of], count)
            yield family

    def text(self) -> bytes:
        """Everything in Prometheus' text format, version 0.0.4."""
        return generate_latest(self._registry)

    def _histogram(self, what: str, *labels: str) -> Histogram:
        name = f"lupin_{what}_seconds"
        return Histogram(name, HISTOGRAMS[name], labels, buckets=_SECONDS, registry=self._registry)


# --- answers over HTTP ----------------------------------------------------------------------------

# (path, status, seconds until the answer began)
Note = Callable[[str, int, float], None]

# Routes below /api with a class of their own.
_OWN: Final = frozenset(
    ("estimate", "export", "field", "history", "map", "signin", "state", "tags", "timeline")
)


def route_class(path: str) -> str:
    """The class of a path's route, for metrics: few, however many paths there are."""
    parts = path.strip("/").split("/")
    if parts[0] == "api" and len(parts) > 1:
        name = parts[1].partition(".")[0]
        return name if name in _OWN else "other"
    if path in ("/healthz", "/readyz", "/metrics"):
        return "health"
    return "docs" if path in ("/docs", "/openapi.json") else "page"


class Metered:
    """ASGI middleware around access control: notes each HTTP answer, and each refusal."""

    def __init__(self, app: ASGIApp, note: Note) -> None:
        self._app = app
        self._note = note

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and note when its answer begins."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began_s = time.monotonic()
        path: str = scope["path"][len(scope.get("root_path", "")) :]

        async def send_and_note(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._note(path, message["status"], time.monotonic() - began_s)
            await send(message)

        await self._app(scope, receive, send_and_note)
