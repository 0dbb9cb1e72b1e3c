"""What a broker has of the greenhouse, and what it needs next: the newest of each topic. Pure."""

from __future__ import annotations

import hashlib
import heapq
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import orjson

from lupin_bridge.alarms.board import MAX_WORST, worst_first
from lupin_bridge.judge.episodes import SITE
from lupin_bridge.judge.quantities import Sensors
from lupin_bridge.judge.scans import SHORTEST_NS
from lupin_bridge.judge.verdict import Health, Verdict, derive
from lupin_bridge.notify.messages import (
    GreenhouseState,
    Topics,
    alarms_payload,
    expire_after_s,
    greenhouse_configs,
    greenhouse_payload,
    health_payload,
    holds,
    reading_payload,
    tag_configs,
    twin_payload,
)
from lupin_twin.core.state import TagState

_NEVER: Final = 2**63 - 1
_UNKNOWN: Final = Health(Verdict.UNKNOWN)
# Topic and payload.
Message = tuple[str, bytes]
# Home Assistant takes an empty announcement for the end of the entity.
_GONE: Final = b""


@dataclass(slots=True)
class _Published:
    """What was published of a tag or the greenhouse: a digest a topic.

    `announced` is what its announcements were made of; `until_ns` is when the first of its readings
    ceases to hold.
    """

    digests: dict[str, bytes] = field(default_factory=dict)
    announced: object = None
    configs: frozenset[str] = frozenset()
    until_ns: int = _NEVER


class Mirror:
    """What a broker has, and what it needs next: the newest of each topic.

    Tags wait for their turn, not payloads: a payload is written at its turn, of what is known by
    then. Belongs to the event loop.
    """

    def __init__(self, topics: Topics, sensors: Sensors) -> None:
        self._topics = topics
        self._sensors = sensors
        self._seen = GreenhouseState()
        self._tags: dict[str, TagState] = {}
        self._published: dict[str, _Published] = {}
        # Tags in their turn, each with the state with which it came to wait; HOUSE: the greenhouse.
        self._waiting: dict[str, TagState | None] = {SITE: None}
        # Before that, no published reading ceases to hold.
        self._first_until_ns = _NEVER
        self.dropped = 0

    @property
    def waiting(self) -> int:
        """How many tags wait, the greenhouse included."""
        return len(self._waiting)

    def forget(self) -> None:
        """The broker knows nothing any more: publish everything again."""
        self._published = {
            tag_id: _Published(configs=published.configs)
            for tag_id, published in self._published.items()
        }
        self._waiting = dict.fromkeys((SITE, *self._tags, *self._published))
        for tag_id in self._waiting:
            self._waiting[tag_id] = self._tags.get(tag_id)

    def see(self, seen: GreenhouseState) -> None:
        """Take the state of now; tags that have changed wait for their turn."""
        before, self._seen = self._seen, seen
        changed: dict[str, None] = {}
        if seen.tags != before.tags:
            known, self._tags = self._tags, {tag.tag_id: tag for tag in seen.tags}
            changed |= dict.fromkeys(t for t, tag in self._tags.items() if known.get(t) is not tag)
            changed |= dict.fromkeys(known.keys() - self._tags.keys())
        old, new = before.judged.tags, seen.judged.tags
        if new is not old:
            changed |= dict.fromkeys(t for t, health in new.items() if old.get(t) is not health)
        if seen.knows_alarms is not before.knows_alarms:
            changed |= dict.fromkeys(self._tags)
        elif seen.board is not before.board:
            was, now = before.board.page.by_tag, seen.board.page.by_tag
            changed |= dict.fromkeys(t for t in {**was, **now} if was.get(t) != now.get(t))
        if (seen.now_ns is None, seen.origin) != (before.now_ns is None, before.origin):
            changed |= dict.fromkeys(self._tags)
        now_ns = seen.now_ns
        if now_ns is not None and self._first_until_ns < now_ns:
            changed |= dict.fromkeys(t for t, it in self._published.items() if it.until_ns < now_ns)
            self._first_until_ns = min(
                (it.until_ns for it in self._published.values() if it.until_ns >= now_ns),
                default=_NEVER,
            )
        for tag_id in changed:
            if tag_id in self._tags or tag_id in self._published:
                self._wait(tag_id, self._tags.get(tag_id))
        self._waiting.setdefault(SITE, None)

    def messages(self) -> Iterator[Message]:
        """The messages of all that wait."""
        while self._waiting:
            tag_id = next(iter(self._waiting))
            del self._waiting[tag_id]
            yield from self._turn_of(tag_id)

    def _wait(self, tag_id: str, tag: TagState | None) -> None:
        if self._waiting.get(tag_id, tag) is not tag:
            self.dropped += 1
        self._waiting[tag_id] = tag

    def _turn_of(self, tag_id: str) -> Iterator[Message]:
        published = self._published.setdefault(tag_id, _Published())
        tag = self._tags.get(tag_id)
        if tag_id != SITE and tag is None:
            del self._published[tag_id]
            yield from ((topic, _GONE) for topic in sorted(published.configs))
            return
        pairs = self._of_greenhouse(published) if tag is None else self._of_tag(tag, published)
        for topic, payload in pairs:
            text = orjson.dumps(payload)
            digest = hashlib.blake2b(text, digest_size=16).digest()
            if published.digests.get(topic) != digest:
                published.digests[topic] = digest
                yield topic, text

    def _of_greenhouse(self, published: _Published) -> Iterator[tuple[str, dict[str, Any]]]:
        yield from self._announced(published, "house", lambda: greenhouse_configs(self._topics))
        seen, topics = self._seen, self._topics
        yield self._with_origin(topics.twin, twin_payload(seen.status))
        yield self._with_origin(topics.of(None, "health"), greenhouse_payload(seen.judged))
        page = seen.board.page
        yield self._with_origin(
            topics.of(None, "alarms"),
            alarms_payload(len(page.active), page.worst, is_known=seen.knows_alarms),
        )

    def _of_tag(self, tag: TagState, published: _Published) -> Iterator[tuple[str, dict[str, Any]]]:
        seen, topics, tag_id = self._seen, self._topics, tag.tag_id
        readings = (*tag.readings, *derive(tag.readings))
        holds_ns = seen.holds_ns.get(tag_id, SHORTEST_NS)
        sensors = [self._sensors.named(reading.name) for reading in readings]
        built_from = tuple(sensor.name for sensor in sensors), expire_after_s(holds_ns)
        yield from self._announced(
            published, built_from, lambda: tag_configs(topics, tag_id, sensors, holds_ns)
        )
        published.until_ns = min(
            (
                reading.observed_at_ns + holds_ns
                for reading in readings
                if reading.observed_at_ns is not None and holds(reading, holds_ns, seen.now_ns)
            ),
            default=_NEVER,
        )
        self._first_until_ns = min(self._first_until_ns, published.until_ns)
        for reading, sensor in zip(readings, sensors, strict=True):
            yield self._with_origin(
                topics.reading(tag_id, reading.name),
                reading_payload(reading, sensor, holds_ns, seen.now_ns),
            )
        yield self._with_origin(
            topics.of(tag_id, "health"),
            health_payload(seen.judged.tags.get(tag_id, _UNKNOWN)),
        )
        active = seen.board.page.by_tag.get(tag_id, ())
        worst = heapq.nsmallest(MAX_WORST, active, key=worst_first)
        yield self._with_origin(
            topics.of(tag_id, "alarms"),
            alarms_payload(len(active), worst, is_known=seen.knows_alarms),
        )

    def _with_origin(self, topic: str, payload: dict[str, Any]) -> tuple[str, dict[str, Any]]:
        """A payload with the origin of its data: nobody is called for a simulation."""
        return topic, {**payload, "origin": self._seen.origin}

    def _announced(
        self,
        published: _Published,
        built_from: object,
        make: Callable[[], Iterable[tuple[str, dict[str, Any]]]],
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """The announcements, where they are of something else than before."""
        if not self._topics.discovery or published.announced == built_from:
            return
        configs = dict(make())
        published.announced, published.configs = built_from, frozenset(configs)
        yield from configs.items()
