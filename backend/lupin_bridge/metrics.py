"""What Prometheus scrapes: numbers are read off at the scrape, times are histograms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from prometheus_client import CollectorRegistry, Histogram, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

CONTENT_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"

Sample = tuple[str, float]

GAUGES: Final = {
    "lupin_clients": "WebSocket clients that follow the state",
    "lupin_clients_blocked": "clients whose socket takes nothing just now",
    "lupin_topics_relayed": "ROS topics that are listened to for viewers",
    "lupin_ros_thread_alive": "1 while the ROS thread runs",
    "lupin_ros_calls_waiting": "calls that wait for the ROS thread",
    "lupin_twin_live": "1 while the twin is live",
    "lupin_twins": "twins that publish the state; more than 1 is a mistake",
    "lupin_state_age_seconds": "seconds since the last state came; infinite: none has",
    "lupin_tags": "tags that the twin knows",
    "lupin_tags_pinned": "tags that have a pose",
    "lupin_alarms_known": "1 once alarms of the past are known",
    "lupin_alarms_active": "alarms that are active",
    "lupin_fields_computing": "field requests being computed now",
    "lupin_exports_running": "exports being sent now",
    "lupin_journal_recording": "1 while the journal keeps what is observed, as promised",
    "lupin_journal_rows_waiting": "observations that are not in the journal yet",
    "lupin_journal_behind_seconds": "for how long the oldest of those has been waiting",
    "lupin_journal_file_bytes": "size of the journal on the disk",
}
# The same, each with a label of its own.
LABELLED_GAUGES: Final = {
    "lupin_outward_connected": ("channel", "1 while the other side takes messages"),
    "lupin_estimate_trusted": (
        "sensor",
        "1 while its estimates are about as often right as they say; absent while nobody knows",
    ),
    "lupin_estimate_fit_failing": ("sensor", "1 while its last round of learning came to nothing"),
    "lupin_outward_waiting": ("channel", "tags, the greenhouse or changes of alarms, not sent yet"),
}
# Written with `_total` behind the name, as Prometheus wants it.
COUNTERS: Final = {
    "lupin_clients_dismissed": "clients closed because they took no frame for too long",
    "lupin_frames_sent": "state frames written to clients",
    "lupin_frames_skipped": "state frames that a client did not get, being slow or wanting fewer",
    "lupin_bytes_sent": "bytes of frames written to clients",
    "lupin_messages_sent": "ROS messages written to viewers as they are",
    "lupin_messages_skipped": "ROS messages that a viewer did not get, being slow, or too large",
    "lupin_alarms_missed": "observations that were received too late for the alarms they belong to",
    "lupin_alarms_raised": "alarms raised since the start; those of the past are not counted",
    "lupin_ros_callback_errors": "errors met by ROS callbacks",
    "lupin_judge_errors": "errors met in judging a tag or a state, whose status is then unknown",
    "lupin_work_abandoned": "computations that were ended because nobody waited any more",
    "lupin_journal_rows": "observations written to the journal",
    "lupin_journal_rows_lost": "observations given up because the journal could not be written",
}
# The same, each with a label of its own.
LABELLED: Final = {
    "lupin_admission_refused": ("reason", "computed answers refused, by the limit they met"),
    "lupin_dropped": ("reason", "messages and entries that the twin dropped or lost"),
    "lupin_web_dropped": ("reason", "messages that `web` itself dropped or lost"),
    "lupin_http_answers": ("status", "HTTP answers of the routes, by status"),
    "lupin_outward_sent": ("channel", "messages that a broker or a receiver has taken"),
    "lupin_outward_failed": ("channel", "connections and posts that failed"),
    "lupin_outward_dropped": (
        "channel",
        "of MQTT, states of tags that gave way to newer ones; of the webhook, changes given up",
    ),
}
HISTOGRAMS: Final = {
    "lupin_push_seconds": (
        "from a change in the ROS thread until every ready client has been written its frame"
    ),
    "lupin_field_seconds": "until a field is computed and written",
}

# From a millisecond to the time-out of a field.
_SECONDS: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)


class Metrics(Collector):
    """The bridge's metrics; `read` gives a sample of each gauge and counter at each scrape."""

    def __init__(
        self,
        read: Callable[[], Iterable[Sample]],
        read_labelled: Callable[[], Iterable[tuple[str, Mapping[str, int]]]] = tuple,
    ) -> None:
        self._read = read
        self._read_labelled = read_labelled
        self._registry = CollectorRegistry()
        self._registry.register(self)
        ProcessCollector(registry=self._registry)
        self.push_seconds = self._histogram("lupin_push_seconds")
        self.field_seconds = self._histogram("lupin_field_seconds")
        self.http_seconds = Histogram(
            "lupin_http_seconds",
            "from a request until its answer began",
            ["route"],
            buckets=_SECONDS,
            registry=self._registry,
        )
        self.past_seconds = Histogram(
            "lupin_past_seconds",
            "until a question of the past is answered, by its kind",
            ["question"],
            buckets=_SECONDS,
            registry=self._registry,
        )

    def describe(self) -> Iterable[Metric]:
        """Nothing: the registry would scrape at once, before there is anything to read."""
        return ()

    def collect(self) -> Iterator[Metric]:
        """The gauges and counters, for the registry."""
        for name, value in self._read():
            if name in GAUGES:
                yield GaugeMetricFamily(name, GAUGES[name], value)
            else:
                yield CounterMetricFamily(name, COUNTERS[name], value)
        for name, counts in self._read_labelled():
            family: GaugeMetricFamily | CounterMetricFamily
            if name in LABELLED_GAUGES:
                label, documentation = LABELLED_GAUGES[name]
                family = GaugeMetricFamily(name, documentation, labels=[label])
            else:
                label, documentation = LABELLED[name]
                family = CounterMetricFamily(name, documentation, labels=[label])
            for name_of, count in counts.items():
                family.add_metric([name_of], count)
            yield family

    def text(self) -> bytes:
        """Everything in Prometheus' text format, version 0.0.4."""
        return generate_latest(self._registry)

    def _histogram(self, name: str) -> Histogram:
        return Histogram(name, HISTOGRAMS[name], buckets=_SECONDS, registry=self._registry)
