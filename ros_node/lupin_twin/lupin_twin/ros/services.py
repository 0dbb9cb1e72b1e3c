"""The services of fields and of the past: requests in, responses made off the node's thread."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from lupin_msgs.srv import GetField, GetHistory, GetStateAt, GetWrites

from lupin_twin.core.interfaces import GET_HISTORY, GET_STATE_AT, GET_WRITES
from lupin_twin.core.past import EVERY_TAG, check_moment
from lupin_twin.core.state import TwinStore
from lupin_twin.field.engine import (
    FieldCache,
    FieldKey,
    FieldRules,
    check_request,
    compute_field,
    cost_s,
)
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.journal import follow
from lupin_twin.journal.fold import STATE_S_PER_TAG, state_at
from lupin_twin.journal.follow import WRITES_S, writes
from lupin_twin.journal.queries import SERIES_S, SERIES_S_PER_TAG, series
from lupin_twin.ros import convert, convert_field, convert_past
from lupin_twin.ros.base_node import SERVICE_QOS, NodeUtilities
from lupin_twin.ros.parameters import naming
from lupin_twin.ros.responses import answer_later, refusal
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import SMALL_S, JobQueue, Query, Workers


@dataclass(frozen=True, slots=True)
class FieldService:
    """The service of fields: what takes longer than a tick is computed off the node's thread."""

    utilities: NodeUtilities
    workers: Workers
    queue: JobQueue
    cache: FieldCache
    rules: Callable[[], FieldRules]
    store: TwinStore
    occupancy: Callable[[], OccupancyMap | None]

    def offer(self, node: Any, name: str, group: Any) -> None:
        """Have `node` offer the service.

        Raises:
            ParameterError: a name that ROS does not take.

        """
        with naming("field_service_name", name):
            node.create_service(
                GetField, name, self._on_get_field, qos_profile=SERVICE_QOS, callback_group=group
            )

    def _on_get_field(self, request: Any, response: Any) -> Any:
        report = self.utilities.report
        try:
            wanted = convert_field.field_request_of(request)
            rules, occupancy = self.rules(), self.occupancy()
            check_request(wanted, rules.max_grid_cells)
        except Exception as error:  # noqa: BLE001  # no client waits for ever
            return refusal(response, error, report)
        revision = None if occupancy is None else occupancy.revision
        key = FieldKey(wanted, self.store.observation_count, revision, rules)
        if (found := self.cache.get(key)) is not None:
            return convert_field.fill_response(response, found)
        samples = self.store.samples_for_sensor(wanted.sensor_type)
        compute = partial(compute_field, wanted, samples, occupancy, rules)
        cost = cost_s(wanted, len(samples), rules)

        def prepare(reply: Callable[[Any], None]) -> Query:
            def keep(grid: Any) -> None:
                if not isinstance(grid, Exception):
                    self.cache.put(key, grid)
                    grid = convert_field.fill_response(response, grid)
                reply(grid)

            return Query(partial(self.workers.submit, compute, cost), keep, cost_s=cost)

        return answer_later(self.queue, prepare, response, report)


# What the message of a series takes at worst, s of one core; and that of all tags.
MESSAGE_S: Final = SMALL_S
EVERY_TAG_S: Final = 1.0


@dataclass(frozen=True, slots=True)
class PastService:
    """The services of one node; belongs to its thread.

    Every request gets a response, where there is no answer one that says why. How large a past
    state may be is estimated by the `store`, that of now.
    """

    utilities: NodeUtilities
    queue: JobQueue
    recall: Recall
    store: TwinStore
    now_ns: Callable[[], int]
    frame_id: str

    def offer(self, node: Any, group: Any) -> None:
        """Have `node` offer the services, by names relative to its namespace; some answer later."""
        for kind, name, callback in (
            (GetStateAt, GET_STATE_AT.name, self._on_get_state_at),
            (GetHistory, GET_HISTORY.name, self._on_get_history),
            (GetWrites, GET_WRITES.name, self._on_get_writes),
        ):
            node.create_service(kind, name, callback, qos_profile=SERVICE_QOS, callback_group=group)

    def _on_get_state_at(self, request: Any, response: Any) -> Any:
        def check() -> Callable[[sqlite3.Connection], Any]:
            at_ns = convert.nanoseconds(request.at)
            check_moment(at_ns, self.now_ns())
            return lambda connection: state_at(connection, at_ns, self.frame_id)

        tags, items = self.store.size
        return self._ask(
            response,
            check,
            tags * STATE_S_PER_TAG,
            convert_past.state_response,
            tags * convert_past.TAG_S + items * convert_past.ITEM_S,
        )

    def _on_get_history(self, request: Any, response: Any) -> Any:
        def check() -> Callable[[sqlite3.Connection], Any]:
            query, now_ns = convert_past.series_request(request), self.now_ns()
            return lambda connection: series(connection, query, now_ns)

        tags = self.store.size[0] if request.tag_id == EVERY_TAG else 0
        search_s = SERIES_S + tags * SERIES_S_PER_TAG
        make_s = EVERY_TAG_S if request.tag_id == EVERY_TAG else MESSAGE_S
        return self._ask(response, check, search_s, convert_past.series_response, make_s)

    def _on_get_writes(self, request: Any, response: Any) -> Any:
        def check() -> Callable[[sqlite3.Connection], Any]:
            query = convert_past.writes_request(request)
            if request.as_rows:
                return lambda connection: follow.read(connection, query.after, query.max_count)
            return lambda connection: writes(connection, query)

        make = convert_past.rows_response if request.as_rows else convert_past.writes_response
        return self._ask(response, check, WRITES_S, make, MESSAGE_S)

    def _ask(
        self,
        response: Any,
        check: Callable[[], Callable[[sqlite3.Connection], Any]],
        search_s: float,
        make: Callable[[Any], Any],
        make_s: float,
    ) -> Any:
        def prepare(reply: Callable[[Any], None]) -> Query:
            search = check()
            return Query(
                lambda: self.recall.query(lambda connection, _: search(connection), search_s),
                reply,
                make,
                make_s,
            )

        return answer_later(self.queue, prepare, response, self.utilities.report)
