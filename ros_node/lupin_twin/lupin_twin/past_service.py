"""The services of the past: questions in, answers built off the node's thread."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final, Protocol

from lupin_msgs.srv import GetHistory, GetStateAt, GetWrites

from lupin_twin import convert, convert_past
from lupin_twin.habits import SERVICE_QOS, Habits
from lupin_twin.interfaces import GET_HISTORY, GET_STATE_AT, GET_WRITES
from lupin_twin.journal import follow
from lupin_twin.journal.fold import STATE_S_PER_TAG, state_at
from lupin_twin.journal.follow import Lot
from lupin_twin.journal.queries import SERIES_S, SERIES_S_PER_TAG, series
from lupin_twin.journal.writes import WRITES_S, writes
from lupin_twin.past import (
    EVERY_TAG,
    NotRemembered,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    check_moment,
)
from lupin_twin.past_desk import PastDesk, Question
from lupin_twin.past_writes import PastWrites, WritesRequest
from lupin_twin.recall import Recall
from lupin_twin.responses import Later
from lupin_twin.state import Snapshot, TwinStore
from lupin_twin.workers import SMALL_S

# What the message of a series takes at worst, s of one core; and looking through all tags.
MESSAGE_S: Final = SMALL_S
EVERY_TAG_S: Final = 1.0


class Remembers(Protocol):
    """What knows the past. Nothing here waits: what takes time is done elsewhere.

    Each raises, or its future does, `PastRefused` or `NotRemembered`.
    """

    def state_at(self, at_ns: int) -> Future[Snapshot]:
        """Every tag as of a moment, ROS time."""

    def series(self, request: SeriesRequest, now_ns: int) -> Future[SeriesPast]:
        """Readings, buckets or events; `now_ns` is where a period without an end ends."""

    def writes(self, request: WritesRequest) -> Future[PastWrites]:
        """What was heard, in the order of hearing."""

    def rows(self, after: int, most: int) -> Future[Lot]:
        """The rows behind a number, at most about so many."""


class PastService:
    """The services of one node; belongs to its thread.

    Who asks gets an answer in any case: where there is none, one that says why. How large a state
    of then may be is estimated by the `store`, that of now.
    """

    def __init__(
        self,
        habits: Habits,
        desk: PastDesk,
        memory: Remembers,
        store: TwinStore,
        now_ns: Callable[[], int],
    ) -> None:
        self._habits = habits
        self._desk = desk
        self._memory = memory
        self._store = store
        self._now_ns = now_ns

    def offer(self, node: Any, group: Any) -> None:
        """Have `node` offer the services, by names relative to its namespace; some answer later."""
        for kind, name, callback in (
            (GetStateAt, GET_STATE_AT.name, self._on_get_state_at),
            (GetHistory, GET_HISTORY.name, self._on_get_history),
            (GetWrites, GET_WRITES.name, self._on_get_writes),
        ):
            node.create_service(kind, name, callback, qos_profile=SERVICE_QOS, callback_group=group)

    def _on_get_state_at(self, request: Any, response: Any) -> Any:
        def look_up() -> Callable[[], Future[Snapshot]]:
            at_ns = convert.nanoseconds(request.at)
            check_moment(at_ns, self._now_ns())
            return lambda: self._memory.state_at(at_ns)

        return self._ask(
            response, look_up, convert_past.state_response, convert_past.building_s(self._store)
        )

    def _on_get_history(self, request: Any, response: Any) -> Any:
        def look_up() -> Callable[[], Future[SeriesPast]]:
            asked = convert_past.series_request(request)
            now_ns = self._now_ns()
            return lambda: self._memory.series(asked, now_ns)

        cost_s = EVERY_TAG_S if request.tag_id == EVERY_TAG else MESSAGE_S
        return self._ask(response, look_up, convert_past.series_response, cost_s)

    def _on_get_writes(self, request: Any, response: Any) -> Any:
        def look_up() -> Callable[[], Future[PastWrites]]:
            asked = convert_past.writes_request(request)
            return lambda: self._memory.writes(asked)

        def look_up_rows() -> Callable[[], Future[Lot]]:
            asked = convert_past.writes_request(request)
            return lambda: self._memory.rows(asked.after, asked.max_count)

        if request.as_rows:
            return self._ask(response, look_up_rows, convert_past.rows_response, MESSAGE_S)
        return self._ask(response, look_up, convert_past.writes_response, MESSAGE_S)

    def _ask(
        self,
        response: Any,
        check: Callable[[], Callable[[], Future[Any]]],
        make: Callable[[Any], Any],
        cost_s: float,
    ) -> Any:
        later = Later()
        try:
            self._desk.ask(
                Question(
                    check(),
                    make,
                    cost_s,
                    lambda answer: later.answer(self._answer(response, answer)),
                )
            )
        except Exception as error:  # noqa: BLE001  # the caller must not wait for ever
            return self._answer(response, error)
        return later

    def _answer(self, response: Any, answer: Any) -> Any:
        if not isinstance(answer, Exception):
            return answer
        if not isinstance(answer, PastRefused | NotRemembered):
            self._habits.report("the past", answer)
        return convert_past.refused(response, answer)


class JournalPast:
    """What the journal remembers; belongs to the node's thread, its answers come in others."""

    def __init__(self, recall: Recall, store: TwinStore, frame_id: str) -> None:
        self._recall = recall
        self._store = store
        self._frame_id = frame_id

    def state_at(self, at_ns: int) -> Future[Snapshot]:
        """The state that a replay up to then leaves."""
        tags, _ = self._store.size
        return self._recall.ask(
            lambda connection, _: state_at(connection, at_ns, self._frame_id),
            tags * STATE_S_PER_TAG,
        )

    def series(self, request: SeriesRequest, now_ns: int) -> Future[SeriesPast]:
        """Readings, buckets or events of the journal."""
        tags = self._store.size[0] if request.tag_id == EVERY_TAG else 0
        return self._recall.ask(
            lambda connection, _: series(connection, request, now_ns),
            SERIES_S + tags * SERIES_S_PER_TAG,
        )

    def writes(self, request: WritesRequest) -> Future[PastWrites]:
        """What the journal's rows say."""
        return self._recall.ask(lambda connection, _: writes(connection, request), WRITES_S)

    def rows(self, after: int, most: int) -> Future[Lot]:
        """The journal's rows."""
        return self._recall.ask(
            lambda connection, _: follow.read(connection, after, most), WRITES_S
        )
