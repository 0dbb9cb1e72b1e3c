"""The process that watches the archive, and judges each site.

It answers each query with the sites that have changed. When a site's last number has changed, the
new rows give its verdict and alarms, by the same judge that a bridge has.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

from lupin_bridge.alarms.board import notes_of_alarms
from lupin_bridge.archive.database import (
    CHANNEL,
    ArchiveError,
    archive_url,
    explaining,
    open_archive,
)
from lupin_bridge.feed.query import LogReader, Now
from lupin_bridge.feed.query import main as serve
from lupin_bridge.fleet.overview import LIVE_S, Site, causes, dots, now_json, worst_first
from lupin_bridge.judge.alarm_fold import AlarmLog
from lupin_bridge.judge.episodes import Alarm, silence
from lupin_bridge.judge.judging import Criteria, Judge, judge_once
from lupin_bridge.judge.scans import recent_writes
from lupin_bridge.judge.verdict import Health
from lupin_bridge.serving.admission import Limits
from lupin_bridge.settings import Settings
from lupin_bridge.stream.state_json import alarm_json
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Origin, origin_of
from lupin_twin.core.notes import Note, NotesRequest
from lupin_twin.core.past import (
    FOREVER_NS,
    NotRemembered,
)
from lupin_twin.core.state import Observation, Snapshot, TagState, same_tags
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.runs import runs, span_at, world_of
from lupin_twin.journal.schema import ORIGIN, DamagedFile, SiteLog
from lupin_twin.journal.writes import notes, writes
from lupin_twin.runtime.workers import ShouldStop

log = logging.getLogger(__name__)

# A forwarder's notification wakes it at once; that may be lost, so it polls too.
POLL_S: Final = 2.0
# Further notifications within this time are taken together with the first.
_GATHER_S: Final = 0.05
# How long it judges before it looks again: no site's liveness waits for the verdicts of others.
_JUDGING_S: Final = 1.0
# Interval of judging a site again without new rows, because its readings grow old.
_AGE_S: Final = 10.0
# How far a site's clock may be ahead of the archive's, ns; readings are valid for longer than that.
# Beyond it, old readings would pass for new ones: no status is known.
MAX_AHEAD_NS: Final = 600 * 10**9
_LOT: Final = 2_000
# The worst alarms of a site that are shown, shelved ones last; its own page has all of them.
MAX_ALARMS: Final = 20

# No value that a site has written, whatever it is, may break this query of all sites.
_FACTS: Final = (
    "SELECT site.site, site.name, coalesce(CAST(extract(epoch FROM"
    " least(greatest(heard_at, 'epoch'), now())) * 1e9 AS BIGINT), 0),"
    " coalesce(heard_at > now() - make_interval(secs => %s), false),"
    " (SELECT ARRAY[seq_offset, forwarded_seq] FROM epoch WHERE epoch.site = site.site"
    " ORDER BY epoch DESC LIMIT 1),"
    " (SELECT value FROM meta WHERE meta.site = site.site AND key = %s),"
    " (SELECT count(*) FROM note WHERE note.site = site.site)"
    " FROM site LEFT JOIN forwarder ON forwarder.site = site.site ORDER BY site.site"
)
_NEWEST: Final = (
    "(SELECT arrival_ns FROM {0} WHERE {0}.site = wanted.site ORDER BY seq DESC LIMIT 1)"
)
_RECEIVED: Final = (
    "SELECT wanted.site, greatest("  # noqa: S608  # constants
    + ", ".join(_NEWEST.format(table) for table in ("scan", "look", "place"))
    + ") FROM unnest(%s::text[]) AS wanted (site)"
)
_NOW: Final = "SELECT CAST(extract(epoch FROM now()) * 1e9 AS BIGINT)"


@dataclass(frozen=True, slots=True)
class _HourAgo:
    """Tags an hour before a moment; an hour is a 24th of the site's day, which is short in a demo.

    As on the page of a greenhouse, it serves for a twelfth of that.
    """

    names: frozenset[str]
    of_ns: int
    hour_s: float
    tags: Mapping[str, TagState]
    healths: Mapping[str, Health]

    def serves(self, names: frozenset[str], moment_ns: int) -> bool:
        """Whether it is that of a moment, and has these tags."""
        return names <= self.names and 0 <= moment_ns - self.of_ns < self.hour_s / 12 * 1e9


@dataclass(slots=True)
class _Judged:
    """What is kept of a site to judge it again; `seq` is the last number that was judged.

    `was_live` is whether it was live then; `notes` are all notes until then.
    """

    judge: Judge
    alarms: AlarmLog
    was_live: bool = False
    notes: tuple[Note, ...] = ()
    note_count: int = 0
    snapshot: Snapshot | None = None
    is_simulated: bool = False
    seq: int = -1
    is_failing: bool = False
    judged_s: float = 0.0
    hour_ago: _HourAgo | None = None


def _origin(name: str, judged: _Judged) -> Origin:
    """A site's origin: never a robot if its clock is simulated, which only judging finds out."""
    if judged.snapshot is None:
        return "unknown" if name == "robot" else origin_of(name, is_simulated=False)
    return origin_of(name, is_simulated=judged.is_simulated)


class Watcher:
    """Looks at the sites of an archive, over one connection."""

    def __init__(self, connection: Any, criteria: Criteria) -> None:
        import psycopg  # noqa: PLC0415  # the extra `fleet`

        self.connection = connection
        self._criteria = criteria
        self.sites: dict[str, Site] = {}
        self._judged: dict[str, _Judged] = {}
        self._reported: Mapping[str, Site] | None = None
        # Time of the last look, by the archive's clock.
        self._now_ns = 0
        self._is_judging = False
        with suppress(psycopg.errors.ReadOnlySqlTransaction):
            connection.execute(f"LISTEN {CHANNEL}")  # a standby cannot listen

    def news(self) -> News:
        """What has changed; looks and judges by turns, so that liveness is reported first."""
        if self._is_judging:
            until_s = time.monotonic() + _JUDGING_S
            for _ in self._judge_due(self._now_ns):
                if time.monotonic() >= until_s:
                    break
        else:
            if self._reported is not None and not any(map(self._is_due, self.sites)):
                self._wait()
            self._now_ns = self._see()
        self._is_judging = not self._is_judging
        known, self._reported = self._reported or {}, dict(self.sites)
        changed = [site for name, site in self.sites.items() if known.get(name) != site]
        return News(self._now_ns, tuple(self.sites), changed)

    def _wait(self) -> None:
        """Wait for a notification, or until it is time to look."""
        is_notified = False
        for _ in self.connection.notifies(timeout=POLL_S, stop_after=1):
            is_notified = True
        if is_notified:
            for _ in self.connection.notifies(timeout=_GATHER_S):
                pass

    def _see(self) -> int:
        """Read which sites are live, and whose log has grown; returns the archive's time, ns."""
        execute = self.connection.execute
        ((now_ns,),) = execute(_NOW).fetchall()
        before, self.sites = self.sites, {}
        judged, self._judged = self._judged, {}
        for site, *facts in execute(_FACTS, (LIVE_S, ORIGIN)).fetchall():
            name, heartbeat_ns, is_live, seqs, origin, note_count = facts
            self._judged[site] = judged.get(site) or self._unjudged()
            self.sites[site] = replace(
                before.get(site, Site(site)),
                name=name,
                heartbeat_ns=heartbeat_ns,
                is_live=is_live,
                last_seq=sum(seqs or ()),
                origin=_origin(origin or "", self._judged[site]),
                notes=note_count,
            )
        grown = [
            name
            for name, site in self.sites.items()
            if name not in before or before[name].last_seq != site.last_seq
        ]
        if grown:
            for name, received_ns in execute(_RECEIVED, (grown,)).fetchall():
                self.sites[name] = replace(self.sites[name], last_received_ns=received_ns)
        return int(now_ns)

    def _judge_due(self, now_ns: int) -> Iterator[str]:
        """Judge the sites that are due, the longest ago first; yields each name when done."""
        for name in sorted(self.sites, key=lambda name: self._judged[name].judged_s):
            if self._is_due(name):
                self._judge_safely(name, now_ns)
                yield name

    def _unjudged(self) -> _Judged:
        return _Judged(Judge(self._criteria), AlarmLog(self._criteria, Limits().alarm_days))

    def _is_due(self, name: str) -> bool:
        """Whether a site has to be judged."""
        site, judged = self.sites[name], self._judged[name]
        is_behind = (
            judged.seq != site.last_seq
            or not judged.alarms.is_caught_up
            or judged.was_live != site.is_live
            or judged.note_count != site.notes
        )
        return (is_behind and not judged.is_failing) or time.monotonic() - judged.judged_s >= _AGE_S

    def _judge_safely(self, name: str, now_ns: int) -> None:
        """Judge a site; one that cannot be judged is unknown, and does not affect the others."""
        import psycopg  # noqa: PLC0415  # the extra `fleet`

        judged = self._judged[name]
        try:
            self._judge(name, judged, now_ns)
        except Exception as error:  # whatever is in its rows, or how long they take
            if self.connection.closed:
                raise  # the archive's error, not the site's
            if not judged.is_failing:
                is_known = isinstance(error, DamagedFile | psycopg.Error)
                why = "site %s cannot be judged: its status is unknown: %s"
                log.warning(why, name, error, exc_info=not is_known)
            # Tried again from its first row on, when others are judged for their age.
            anew = replace(self._unjudged(), is_failing=True, judged_s=time.monotonic())
            self._judged[name] = anew
            self.sites[name] = replace(
                self.sites[name], verdict=None, active_alarms=None, causes=(), alarms=(), dots=""
            )
        else:
            judged.is_failing = False

    def _judge(self, name: str, judged: _Judged, now_ns: int) -> None:
        site = self.sites[name]
        log: Any = SiteLog(self.connection, name)
        with self.connection.transaction():
            if judged.seq != site.last_seq:
                self._read(log, judged)
                judged.seq = site.last_seq
            if not judged.alarms.is_caught_up or judged.alarms.last < site.last_seq:
                self._follow(log, judged)
            if judged.note_count != site.notes:
                judged.notes = notes(log, NotesRequest()).notes or ()
                judged.note_count = site.notes
        assert judged.snapshot is not None  # it has been read above, at the latest
        newest_ns = judged.snapshot.stamp_ns
        # A simulation's time does not advance between two looks.
        now_ns = newest_ns if judged.is_simulated else now_ns
        # The last known state of a silent site does not grow old.
        moment_ns = now_ns if site.is_live else min(now_ns, max(site.heartbeat_ns, newest_ns))
        alarms = _alarms(site, judged, moment_ns)
        is_ahead = newest_ns - now_ns > MAX_AHEAD_NS
        judgement = judged.judge.see(
            replace(judged.snapshot, stamp_ns=moment_ns, clock="doubted" if is_ahead else "running")
        )
        if judged.alarms.is_caught_up:
            said = notes_of_alarms(alarms, judged.notes, now_ns)
            is_current = site.is_live and not is_ahead
            tags = {tag.tag_id: tag for tag in judged.snapshot.tags} if is_current else {}
            active: list[tuple[Alarm, dict[str, Any]]] = [
                (
                    alarm,
                    {
                        **alarm_json(alarm, said.get(alarm.id)),
                        "now": now_json(alarm, tags, judgement.tags),
                    },
                )
                for alarm in alarms
                if alarm.is_active
            ]
            active.sort(key=lambda it: worst_first(it[1]))
            calling = [it for it in active if "shelved_by" not in it[1]]
            self._add_hour_ago(log, judged, active[:MAX_ALARMS], moment_ns)
            site = replace(
                site,
                active_alarms=len(calling),
                causes=causes(entry for _, entry in calling),
                alarms=tuple(entry for _, entry in active[:MAX_ALARMS]),
            )
        judged.judged_s, judged.was_live = time.monotonic(), site.is_live
        self.sites[name] = replace(
            site,
            verdict=judgement.house.verdict,
            dots=dots(judged.snapshot.tags, judgement.tags),
        )

    def _add_hour_ago(
        self,
        log: Any,
        judged: _Judged,
        shown: Sequence[tuple[Alarm, dict[str, Any]]],
        moment_ns: int,
    ) -> None:
        """Add to shown alarms their value an hour of the site's day ago, for a trend."""
        names = frozenset(alarm.tag_id for alarm, entry in shown if entry["now"])
        before = judged.hour_ago
        if names and not (before and before.serves(names, moment_ns)):
            hour_s = world_of(log).day_length_s / 24
            at_ns = moment_ns - int(hour_s * 1e9)
            with self.connection.transaction():
                found = state_at(log, at_ns, "")
                then = replace(found, tags=tuple(it for it in found.tags if it.tag_id in names))
                healths = judge_once(then, _recent(log, at_ns), self._criteria).tags
            tags = {tag.tag_id: tag for tag in then.tags}
            before = judged.hour_ago = _HourAgo(names, moment_ns, hour_s, tags, healths)
        for alarm, entry in shown if before else ():
            assert before is not None
            known = now_json(alarm, before.tags, before.healths) if entry["now"] else None
            entry |= {"hour_ago": known, "hour_s": before.hour_s}

    def _read(self, log: Any, judged: _Judged) -> None:
        span = span_at(runs(log.execute), FOREVER_NS)
        judged.is_simulated = span is not None and span.is_simulated
        found = state_at(log, FOREVER_NS, "")
        before = judged.snapshot
        # Unchanged tags are not judged a second time.
        tags = same_tags(before, found.tags)
        newest_ns = max((tag.last_observed_ns or 0 for tag in tags), default=0)
        judged.snapshot = replace(found, stamp_ns=newest_ns, tags=tags)
        if before is None and tags:
            judged.judge.see(judged.snapshot)
            judged.judge.learn(_recent(log, newest_ns))

    def _follow(self, log: Any, judged: _Judged) -> None:
        assert judged.snapshot is not None  # it was read before
        was_caught_up = judged.alarms.is_caught_up
        past = writes(log, judged.alarms.request(_LOT))
        judged.alarms.take(past, judged.snapshot.tags)
        if was_caught_up and judged.alarms.is_caught_up:
            judged.judge.note_writes(past.of_newest_run)


def _recent(log: Any, at_ns: int) -> list[Observation]:
    return recent_writes(at_ns, LogReader(log, Now(at_ns, "", UNKNOWN_JOURNAL)))


def _alarms(site: Site, judged: _Judged, moment_ns: int) -> list[Alarm]:
    """The alarms of its log, and that of its silence, with the same ids as on its own page.

    Also gives the judge the daily quantities of the log.
    """
    reach_ns = int(Limits().alarm_days * 86_400e9)
    found: list[Alarm] = []
    if judged.alarms.fold is not None:
        of_log = judged.alarms.fold.found(moment_ns, max(0, moment_ns - reach_ns))
        judged.judge.note_days(of_log.days)
        found += of_log.alarms
    if site.heartbeat_ns and not site.is_live:
        found.append(silence(moment_ns if judged.is_simulated else site.heartbeat_ns))
    return found


# --- the process ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class News:
    """The answer: `names` are those of all sites, `changed` the sites that are new or changed."""

    now_ns: int
    names: tuple[str, ...]
    changed: Sequence[Site]


class FromWatcher:
    """An `Answerer`: a query is the settings to judge by."""

    def __init__(self) -> None:
        self._watcher: Watcher | None = None

    def __call__(self, settings: Settings, _now: Now, _should_stop: ShouldStop) -> News:
        """What has changed since the last query."""
        try:
            with explaining():
                if self._watcher is None:
                    connection = open_archive(archive_url())
                    self._watcher = Watcher(connection, Criteria.of(settings))
                return self._watcher.news()
        except ArchiveError as error:
            if self._watcher is not None:
                self._watcher.connection.close()
                self._watcher = None
            raise NotRemembered(str(error)) from error


def main() -> None:
    """Answer the parent until it ends."""
    logging.getLogger("psycopg").setLevel(logging.CRITICAL)
    serve(FromWatcher)
