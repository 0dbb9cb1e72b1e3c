"""The field of one sensor as JSON, PNG or NPY, and the routes that answer in every format."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from lupin_bridge.field import formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import FORMATS, JSON, FieldFormat
from lupin_bridge.field.query import FieldQuery
from lupin_bridge.judge.derived import DAILY
from lupin_bridge.past import query as past_query
from lupin_bridge.past.fields import Field
from lupin_bridge.query_string import parameters_of, read
from lupin_bridge.routes.answers import (
    NOT_REMEMBERED,
    REFUSALS,
    bridge_of,
    error_response,
    json_response,
    list_header,
    read_route,
    refusal,
    respond_as_of,
    respond_newest,
)
from lupin_bridge.serving.admission import ClientLimitError
from lupin_bridge.stream import schema
from lupin_twin.core.past import PastRefused
from lupin_twin.field.engine import FieldRefused

router = APIRouter()

# Quantities of a day change slowly: now is the last whole minute.
_MINUTE_NS: Final = 60 * 1_000_000_000


@dataclass(frozen=True, slots=True)
class InFormats:
    """An answer in every format: a route for each, and one where Accept chooses.

    It is refused as the ROS service refuses it. So `parameters` are read by hand, and a refusal has
    the service's own body (`refusal_json`); `model` is that body's type.
    """

    name: str
    summary: str
    description: str
    parameters: Sequence[Any]
    model: type[BaseModel]
    refusal_json: Callable[[str], bytes]

    def refusals(self) -> dict[int | str, dict[str, Any]]:
        """What stands in the way of an answer, for the OpenAPI document."""
        return {
            304: {"description": "the ETag still holds"},
            400: {"model": self.model, "description": "refused; error_message has the reason"},
            429: {"model": self.model, "description": "too many requests from this client"},
            404: NOT_REMEMBERED[404],
            503: {"model": schema.ErrorMessage, "description": "the twin is not there, or busy"},
            504: {"model": schema.ErrorMessage, "description": "the twin did not answer in time"},
        }

    async def or_refusal(self, answer: Awaitable[Response]) -> Response:
        """The answer, or the service's refusal."""
        try:
            return await answer
        except (FieldRefused, PastRefused) as error:
            return json_response(self.refusal_json(str(error)), 400)
        except ClientLimitError as error:
            return json_response(self.refusal_json(str(error)), 429, error.headers)
        except REFUSALS as error:
            return refusal(error)

    def register(
        self, router: APIRouter, answer: Callable[[Request, FieldFormat], Awaitable[Response]]
    ) -> None:
        """Add `/api/<name>` and `/api/<name>.<format>`; `answer` may raise refusals."""
        documented: dict[str, Any] = {"openapi_extra": {"parameters": list(self.parameters)}}
        binary = {"schema": {"type": "string", "format": "binary"}}

        @read_route(
            router,
            f"/api/{self.name}",
            summary=f"{self.summary}, in the format of the header Accept",
            description=self.description,
            responses={
                200: {
                    "model": self.model,
                    "content": {each.media_type: binary for each in FORMATS if each is not JSON},
                },
                **self.refusals(),
                406: {"model": schema.ErrorMessage, "description": "no format that Accept allows"},
            },
            name=self.name,
            **documented,
        )
        async def in_accepted_format(request: Request) -> Response:
            field_format = field_query.negotiate(list_header(request, "accept"))
            if field_format is None:
                types = ", ".join(known.media_type for known in FORMATS)
                return error_response(f"Accept allows none of {types}", 406, {"Vary": "Accept"})
            response = await self.or_refusal(answer(request, field_format))
            response.headers["Vary"] = "Accept"
            return response

        def in_one(field_format: FieldFormat) -> None:
            content = {"content": {field_format.media_type: binary}}

            @read_route(
                router,
                f"/api/{self.name}.{field_format.name}",
                summary=f"{self.summary} as {field_format.name.upper()}",
                responses={
                    200: {"model": self.model} if field_format is JSON else content,
                    **self.refusals(),
                },
                name=f"{self.name}_{field_format.name}",
                **documented,
            )
            async def in_one_format(request: Request) -> Response:
                return await self.or_refusal(answer(request, field_format))

        for field_format in FORMATS:
            in_one(field_format)


FIELDS: Final = InFormats(
    name="field",
    summary="The field of one sensor",
    description="""Inverse-distance-weighted from the pinned tags; not known where no tag is near.

As of a moment that has passed: of the tags as they were then, by the rules and on the map of
now.""",
    parameters=parameters_of(FieldQuery),
    model=schema.GetFieldResponse,
    refusal_json=formats.refusal_json,
)


async def _answer(request: Request, field_format: FieldFormat | None) -> Response:
    """The field in a format; None: its quality."""
    bridge = bridge_of(request)
    source, now_ns = bridge.source, bridge.ros_time_ns
    query = read(FieldQuery, request.query_params.multi_items(), FieldRefused)
    at_ns = past_query.at_of(query.at, now_ns)
    if at_ns is None and query.sensor_type in DAILY and now_ns is not None:
        at_ns = now_ns - now_ns % _MINUTE_NS
    field = Field(at_ns, query, field_format, source.rules, source.occupancy_map(), bridge.criteria)
    field.check()
    if at_ns is None:
        return await respond_newest(request, field)
    return await respond_as_of(request, field, at_ns)


FIELDS.register(router, _answer)


@read_route(
    router,
    "/api/field/quality",
    summary="How far off the field is, and how much of it is known",
    responses={200: {"model": schema.FieldQuality}, **FIELDS.refusals()},
    openapi_extra={"parameters": [p for p in FIELDS.parameters if p["name"] != "scale"]},
)
async def field_quality(request: Request) -> Response:
    """The leave-one-out error of the current readings, and the share of cells painted."""
    return await FIELDS.or_refusal(_answer(request, None))
