"""The alarms: active ones, and those of a period that has passed."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from typing import Final

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.middleware import client_of
from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.past import query
from lupin_bridge.past.query import AlarmsQuery
from lupin_bridge.query_string import parameters_of
from lupin_bridge.routes.computing import kept_or_computed, on_worker, or_refusal
from lupin_bridge.routes.tools import JSON_TYPE, NEVER_KEEP, NOT_REMEMBERED, bridge_of, read_route
from lupin_bridge.serving.kept import Answer
from lupin_bridge.stream import schema
from lupin_bridge.stream.health_json import alarms_body

router = APIRouter()

MAX_ALARMS: Final = 2_000
# What going through an alarm and writing it take, roughly and at worst.
_WRITE_ALARM_S: Final = 10e-6


@read_route(
    router,
    "/api/alarms",
    summary="What was wrong, where, from when to when, and how bad at worst",
    responses={200: {"model": schema.Alarms}, **NOT_REMEMBERED},
    openapi_extra={"parameters": parameters_of(query.OfAlarms)},
)
async def alarms_route(request: Request) -> Response:
    """Alarms that were active at any time of the period, the newest first and 2,000 at most.

    They follow from what was observed and the ranges of now, the same in every replica.
    """
    return await or_refusal(_alarms(request))


async def _alarms(request: Request) -> Response:
    bridge = bridge_of(request)
    asked = query.alarms(request.query_params.multi_items(), bridge.ros_time_ns)
    board = bridge.alarms.now

    alarms = board.active if asked.active else board.alarms

    def body() -> bytes:
        found = list(islice(filter(_of(asked), alarms), MAX_ALARMS))
        return orjson.dumps(alarms_body(found, board.source, board.since_ns))

    async def compute() -> Answer:
        with bridge.admission.computing(client_of(request)):
            text = await on_worker(bridge, lambda _: body(), len(alarms) * _WRITE_ALARM_S)
        return Answer(text, JSON_TYPE, NEVER_KEEP)

    return await kept_or_computed(request, ("alarms", board.number, asked), compute)


def _of(asked: AlarmsQuery) -> Callable[[Alarm], bool]:
    def is_asked(alarm: Alarm) -> bool:
        if asked.active is not None and alarm.is_active is not asked.active:
            return False
        if asked.end_ns and alarm.raised_at_ns >= asked.end_ns:
            return False
        cleared_ns = alarm.cleared_at_ns
        return cleared_ns is None or cleared_ns >= asked.start_ns

    return is_asked
