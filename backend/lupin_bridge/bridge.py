"""The core of the bridge: judges the twin's states, and sends them to clients at a limited rate.

It also watches for a silent twin and for stuck clients.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Hashable, Iterator, Mapping
from typing import Final

from lupin_bridge.alarms.board import AlarmBoard, Change, NoteBoard
from lupin_bridge.alarms.feed import AlarmFeed, learn_recent
from lupin_bridge.feed.source import RobotLog, TwinSource, TwinUnavailableError, TwinUpdate
from lupin_bridge.feed.tasks import Guard, Periodic, Shared, end
from lupin_bridge.judge.judging import NOTHING_JUDGED, Criteria, Judge, Judged, silenced, unjudged
from lupin_bridge.metrics import Metrics, Sample, route_class
from lupin_bridge.notify.channels import Channels
from lupin_bridge.notify.messages import GreenhouseState
from lupin_bridge.past.fields import Reports, all_changed
from lupin_bridge.serving.admission import Admission, AnswerCache, Limits, RateLimit
from lupin_bridge.settings import Settings
from lupin_bridge.stream.frames import FrameWriter, Liveness, Status, alarms_message, text_frame
from lupin_bridge.stream.hub import Hub
from lupin_bridge.stream.state_json import robot_message
from lupin_bridge.viewers.foxglove import Offer
from lupin_bridge.viewers.rosbridge_session import Writer
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.drops import Reason
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimates import Report, sensors_of

log = logging.getLogger(__name__)

# Interval of the check for silence and stuck clients. A twin is silent after 3 s, and clients have
# to know by 3.5 s.
WATCH_PERIOD_S = 0.2


# A heartbeat this soon after a frame is not sent. With one heartbeat per second, frames are still
# at most 1.8 s apart; a browser reports silence after 3 s.
HEARTBEAT_SPARED_S = 0.8

# Frames that may be sent back to back while the mean rate allows it. With 1, a single late change
# would shift the schedule: every later change of a producer at exactly this rate would wait.
PACE_BURST: Final = 2.0
# Worst-case time to write an alarms frame, and the limits on the rate of such frames: each holds
# all alarms, and goes to every client.
ALARMS_S: Final = 0.03
ALARMS_REST_S: Final = 1.0
ALARM_BYTES_PER_S: Final = 500_000
# Reports on estimates: the pause between two rounds, which take at most a tenth of a core.
GRADING_PERIOD_S: Final = 15.0
GRADING_REST: Final = 9.0
# Interval of polling the robot's topics: its frames come no more often.
ROBOT_PERIOD_S: Final = 1.0


class Bridge:
    """Everything between a source and its clients. Belongs to the event loop.

    `clock` returns monotonic seconds. Bridges may share one `admission`.
    """

    def __init__(
        self,
        source: TwinSource,
        settings: Settings,
        clock: Callable[[], float] = time.monotonic,
        criteria: Criteria | None = None,
        outward: Channels | None = None,
        *,
        limits: Limits = Limits(),
        admission: Admission | None = None,
        cache: AnswerCache | None = None,
    ) -> None:
        self._clock = clock
        self.source = source
        self.workers = source.workers
        self.site = settings.site
        self.limits = limits
        self.liveness = Liveness(lambda: source.world, lambda: source.problems)
        self.hub = Hub(settings.max_clients, limits.client_timeout_s, self.liveness.status)
        self.admission = admission or Admission(limits)
        self.cache = AnswerCache() if cache is None else cache
        self.answering = Shared()
        self.criteria = criteria or Criteria.of(settings)
        self.frames = FrameWriter(self.criteria.sensors.by_name)
        self.offer = Offer(source)
        self.rosbridge_writer = Writer(source.relay, source.workers)
        self.judge = Judge(self.criteria, knows_recent=False)
        self._judged = NOTHING_JUDGED
        self._states_unjudged = 0
        self._is_judge_failing = False
        self._reports: Mapping[str, Report] = {}
        self._grading = Periodic(self._grade, GRADING_PERIOD_S, "what estimates are worth")
        self.alarms = AlarmBoard(self._on_alarms)
        self.alarm_feed = AlarmFeed(
            source, self.judge, self.alarms, lambda: self.ros_time_ns, limits.alarm_days
        )
        self.robot = RobotLog()
        self._robot_look = Periodic(self._look_at_robot, ROBOT_PERIOD_S, "the look at the robot")
        self._has_alarms = asyncio.Event()
        self.notes = NoteBoard(source, self._has_alarms.set)
        self.takes_observations = settings.http_observations == "on" and source.takes_observations
        self.observations_pace = RateLimit(limits.observations_per_s, limits.observation_burst)
        self.outward = outward or Channels()
        self.http_answers: Counter[str] = Counter()
        self.metrics = Metrics(self._measure)
        self.alarms_raised = 0
        self.cached_state: Hashable = None
        self.state_number = 0
        self._published: Status | None = None
        self._pushed: TwinUpdate | None = None
        self._pushed_s = 0.0
        self._pace = RateLimit(limits.frames_per_s, PACE_BURST)
        self._push_timer: asyncio.TimerHandle | None = None
        self._watch = Periodic(self._look_around, WATCH_PERIOD_S, "the watch")
        self._learning: asyncio.Task[None] | None = None
        self._publishing_alarms: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Start the source and the watch.

        Raises:
            Exception: whatever the source raised at its start.

        """
        await self.source.start(self._on_state, self._on_death)
        self._publish_status()
        self._watch.start()
        self._publishing_alarms = asyncio.create_task(self._publish_alarms(), name="alarm frames")
        self.outward.start(self, self.criteria.sensors)
        if self.latest is not None:  # there may be no second state: a silent site sends one
            self.notes.start()
        self.alarm_feed.start()
        self._grading.start()
        self._robot_look.start()

    async def stop(self) -> None:
        """Stop all that `start` began; call `announce_shutdown` first to notify the clients."""
        await end(self._learning, self._publishing_alarms)
        await self._watch.stop()
        await asyncio.gather(self.alarm_feed.stop(), self.notes.stop())
        await asyncio.gather(self._grading.stop(), self._robot_look.stop())
        if self._push_timer is not None:
            self._push_timer.cancel()
        await asyncio.gather(self.outward.stop(), self.source.stop())

    def announce_shutdown(self) -> None:
        """Notify every client that the bridge is shutting down."""
        self.liveness.shutting_down = True
        self._publish_status()

    # --- for the routes -----------------------------------------------------------------------

    @property
    def latest(self) -> TwinUpdate | None:
        """The newest state, without rate limit; None until one is received."""
        return self.liveness.update

    @property
    def status(self) -> Status:
        """The status now."""
        return self.liveness.status(self._clock())

    @property
    def origin(self) -> Origin:
        """Where observations come from, as reported by the twin or, before it is seen, its log."""
        return self.status.update.origin

    @property
    def ros_time_ns(self) -> int | None:
        """ROS time now, ns: the newest state's, plus the time since it came; None: not known."""
        latest, silent_s = self.latest, self.liveness.silent_s(self._clock())
        if latest is None or silent_s is None:
            return None
        if latest.snapshot.clock != "running":  # paused: it does not advance
            return latest.snapshot.now_ns
        return latest.snapshot.stamp_ns + int(silent_s * NANOSECONDS_PER_SECOND)

    @property
    def judged(self) -> Judged:
        """The judgement sent with the last frame; if the twin is silent, that it is silent."""
        return self._judged if self.status.is_live else silenced(self._judged)

    def seen(self) -> GreenhouseState:
        """The current state of the greenhouse, for notifications."""
        return GreenhouseState(
            self.status,
            self.judged,
            self.alarms.now,
            holds_ns=self.judge.holds_ns(),
            now_ns=self.ros_time_ns,
        )

    def note_answer(self, path: str, status: int, seconds: float) -> None:
        """Count an HTTP answer, which has begun."""
        self.http_answers[str(status)] += 1
        self.metrics.http_seconds.labels(route_class(path)).observe(seconds)

    def _measure(self) -> Iterator[Sample]:
        hub, source, status = self.hub, self.source, self.status
        latest = self.latest
        journal = source.journal()
        yield "lupin_clients", len(hub)
        yield "lupin_clients_blocked", hub.blocked
        yield "lupin_clients_dismissed", hub.clients_dismissed
        yield "lupin_frames_sent", hub.frames_sent
        yield "lupin_frames_skipped", hub.frames_skipped
        yield "lupin_bytes_sent", hub.bytes_sent
        yield "lupin_messages_sent", source.relay.sent
        yield "lupin_messages_skipped", source.relay.skipped
        yield "lupin_ros_thread_alive", source.thread.is_alive
        yield "lupin_ros_calls_waiting", source.thread.calls_waiting
        yield "lupin_ros_callback_errors", source.thread.callback_errors
        yield "lupin_twin_live", status.is_live
        yield "lupin_twins", status.update.twin_count
        yield (
            "lupin_state_age_seconds",
            math.inf if status.state_age_s is None else status.state_age_s,
        )
        yield "lupin_tags", 0 if latest is None else len(latest.snapshot.tags)
        yield "lupin_judge_errors", self._states_unjudged
        yield "lupin_alarms_known", self.alarms.now.source != "starting"
        yield "lupin_alarms_active", len(self.alarms.now.active)
        yield "lupin_alarms_missed", self.alarm_feed.missed
        yield "lupin_alarms_raised", self.alarms_raised
        yield "lupin_fields_computing", self.admission.being_computed
        yield "lupin_admission_refused", self.admission.refused
        yield "lupin_http_answers", self.http_answers
        yield from self.outward.counts()
        # Counts that the twin does not report are absent, not zero.
        for name, counts in (
            ("lupin_dropped", None if latest is None else latest.counts),
            ("lupin_web_dropped", None if latest is None else latest.own_counts),
        ):
            if counts is not None:
                yield name, {str(why): counts.dropped.get(why, 0) for why in Reason}
        # Not the state of what is read here: a copy can be read while nothing is added to it.
        recording = status.update.journal.state
        if recording != "unknown":  # absent, not zero
            yield "lupin_journal_recording", recording == "recording"
        if journal.state == "unknown":
            return
        yield "lupin_journal_rows", journal.written
        yield "lupin_journal_rows_lost", journal.lost
        yield "lupin_journal_rows_waiting", journal.waiting
        yield "lupin_journal_behind_seconds", journal.behind_s
        yield "lupin_journal_file_bytes", journal.file_bytes

    # --- from the source ----------------------------------------------------------------------

    def _on_state(self, state: TwinUpdate) -> None:
        self.state_number += 1
        now_s = self._clock()
        self.liveness.update, self.liveness.updated_s = state, now_s
        self.alarm_feed.on_state(state)
        if self._push_timer is not None:
            return  # the timer will send this state
        if self._is_redundant(state, now_s):
            return
        self._push_when_due()

    def _push_when_due(self) -> None:
        self._push_timer = None
        wait_s = self._pace.take("", self._clock())
        if wait_s > 0.0:
            loop = asyncio.get_running_loop()
            self._push_timer = loop.call_later(wait_s, self._push_when_due)
        else:
            self._push()

    def _is_redundant(self, state: TwinUpdate, now_s: float) -> bool:
        """Whether this is only a heartbeat, and a frame has just been sent.

        It has nothing new, and would make a change right behind it wait for its slot.
        """
        pushed = self._pushed
        return (
            pushed is not None
            and now_s < self._pushed_s + HEARTBEAT_SPARED_S
            and state.revision == pushed.revision
            and state.snapshot.tags == pushed.snapshot.tags
        )

    def _push(self) -> None:
        state = self.latest
        if state is None:
            return
        now_s = self._clock()
        self._pushed, self._pushed_s = state, now_s
        self._publish_status()
        # A source answers once it has started; its first state may come before that.
        has_started = self._publishing_alarms is not None
        if has_started:
            self.notes.start()
        if has_started and self._learning is None and state.snapshot.tags:
            work = learn_recent(self.source, self.judge, state.snapshot)
            self._learning = asyncio.create_task(work, name="recent")
        self._judged = self._judge_state(state.snapshot)
        self.hub.publish(self.frames.state(state.snapshot, state.revision, self._judged), now_s)
        self.metrics.push_seconds.observe(time.monotonic() - state.made_s)

    async def _report_on(self, sensor: str, snapshot: Snapshot) -> Report:
        now_ns, day_s = snapshot.now_ns or snapshot.stamp_ns, self.source.world.day_length_s
        wanted = Reports(sensor, None, now_ns, day_s, self.criteria.sensors)
        return (await self.source.ask(wanted, wanted.cost_s(len(snapshot.tags))))[sensor]

    async def _grade(self) -> None:
        """Pass on to the judge which sensors have changed, by the reports on all estimates."""
        if self.latest is None:
            return
        begun_s = time.monotonic()
        snapshot = self.latest.snapshot
        self._reports = await current_reports(snapshot, self._report_on, self._reports)
        self.judge.note_changed(all_changed(self._reports))
        await asyncio.sleep(GRADING_REST * (time.monotonic() - begun_s))

    async def _look_at_robot(self) -> None:
        now_ns = self.ros_time_ns
        try:
            reported = await self.source.robot(now_ns)
        except TwinUnavailableError:  # the ROS thread has ended, which the status reports
            return
        if reported is not None and self.robot.take(reported, now_ns):
            wire = text_frame(robot_message(self.robot))
            self.hub.publish_beside("robot", wire, self._clock())

    def _judge_state(self, snapshot: Snapshot) -> Judged:
        try:
            judged = self.judge.see(snapshot)
        except Exception:  # whatever failed: the state itself must be sent
            self._states_unjudged += 1
            if not self._is_judge_failing:
                log.exception("the state could not be judged: every status is unknown")
            self._is_judge_failing = True
            return unjudged(snapshot)
        self._is_judge_failing = False
        return judged

    def _on_alarms(self, change: Change) -> None:
        if not change.is_past:
            self.alarms_raised += sum(alarm.is_active for alarm in change.changed)
        self.outward.on_alarms(change)
        self._has_alarms.set()

    async def _publish_alarms(self) -> None:
        """Send the alarms after each change; a worker writes the frame, which may hold 1,000."""
        guard = Guard("the newest alarms could not be sent")
        while True:
            await self._has_alarms.wait()
            self._has_alarms.clear()
            size = await guard.run(self._send_alarms())
            if isinstance(size, int):
                # If many alarms change all the time, send no more than a browser can take.
                await asyncio.sleep(max(ALARMS_REST_S, size / ALARM_BYTES_PER_S))

    async def _send_alarms(self) -> int:
        """Send the alarms; returns the size of the frame, bytes."""
        board, now_ns, notes = self.alarms.now, self.ros_time_ns, self.notes.notes or ()
        count = self.notes.count
        wire = await asyncio.wrap_future(
            self.workers.submit(lambda _: alarms_message(board, now_ns, notes, count), ALARMS_S)
        )
        self.hub.publish_beside("alarms", wire, self._clock())
        return len(wire)

    def _on_death(self) -> None:
        self.liveness.thread_dead = True
        self._publish_status()

    # --- the watch ----------------------------------------------------------------------------

    def _publish_status(self) -> None:
        self.liveness.outward = self.outward.status()
        status = self.status
        if not status.is_news_after(self._published):
            return
        is_good = status.is_live and status.update.twin_count <= 1
        before = self._published
        # A fleet closes pages that nobody reads any more: nothing to log.
        is_end = status.reason == "shutting_down"
        if not is_end and (status.message != before.message if before else not is_good):
            # A fleet has many bridges.
            message = f"site {self.site}: {status.message}" if self.site else status.message
            log.log(logging.INFO if is_good else logging.WARNING, "%s", message)
        self._published = status
        if status.reason not in ("never_seen", "shutting_down"):
            last = self.latest
            self.alarm_feed.on_silence(
                is_silent=not status.is_live,
                last_ns=None if last is None else last.snapshot.now_ns,
            )
        self.hub.announce(self._clock())

    async def _look_around(self) -> None:
        self._publish_status()
        now_s = self._clock()
        if not self.status.is_live:
            self.hub.remind(now_s)
        self.hub.serve_all(now_s)  # clients with a low rate may be due by now
        if stuck := self.hub.dismiss_stuck(now_s):
            log.warning("disconnected %d clients that accepted no frame", stuck)


async def current_reports(
    snapshot: Snapshot,
    report_on: Callable[[str, Snapshot], Awaitable[Report]],
    known: Mapping[str, Report],
) -> dict[str, Report]:
    """The report on each sensor, one after the other; where one fails, the `known` one holds."""
    reports: dict[str, Report] = {}
    for name in sensors_of(snapshot):
        try:
            reports[name] = await report_on(name, snapshot)
        except (FieldRefused, NotRemembered, PastRefused, TwinUnavailableError):
            if name in known:
                reports[name] = known[name]
    return reports
