"""The service of fields: what takes longer than a tick is computed off the node's thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from lupin_msgs.srv import GetField

from lupin_twin.core.state import TwinStore
from lupin_twin.field.engine import FieldEngine, FieldJob
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.ros import convert_field
from lupin_twin.ros.base_node import SERVICE_QOS, NodeUtilities
from lupin_twin.ros.parameters import naming
from lupin_twin.ros.responses import answer_later, refusal
from lupin_twin.runtime.workers import JobQueue, Query, Workers


@dataclass(frozen=True, slots=True)
class FieldService:
    """The service of one node; belongs to its thread."""

    utilities: NodeUtilities
    workers: Workers
    queue: JobQueue
    fields: FieldEngine
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
            found = self.fields.lookup(wanted, self.store, self.occupancy())
        except Exception as error:  # noqa: BLE001  # no client waits for ever
            return refusal(response, error, report)
        if not isinstance(found, FieldJob):
            return convert_field.fill_response(response, found)
        job = found

        def prepare(reply: Callable[[Any], None]) -> Query:
            def keep(grid: Any) -> None:
                if not isinstance(grid, Exception):
                    self.fields.keep(job, grid)
                    grid = convert_field.fill_response(response, grid)
                reply(grid)

            search = partial(self.workers.submit, job.compute, job.cost_s)
            return Query(search, keep, cost_s=job.cost_s)

        return answer_later(self.queue, prepare, response, report)
