"""Answers that there are in every format: a route for each, and one where Accept says which."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import FORMATS, JSON, FieldFormat
from lupin_bridge.routes.computing import or_refusal
from lupin_bridge.routes.tools import error_response, json_response, list_header, read_route
from lupin_bridge.serving.admission import ClientLimitError
from lupin_bridge.stream import schema
from lupin_twin.fields import FieldRefused
from lupin_twin.past import PastRefused


@dataclass(frozen=True, slots=True)
class InFormats:
    """What is answered: below which path, and as what a service over ROS refuses it.

    `parameters` are read by hand, so that a refusal has the service's own body (`refusal_json`);
    `model` is that body's type.
    """

    name: str
    summary: str
    description: str
    parameters: Sequence[Any]
    model: type[BaseModel]
    refusal_json: Callable[[str], bytes]

    def refusals(self) -> dict[int | str, dict[str, Any]]:
        """What `refusing` makes of what stands in the way, for the OpenAPI document."""
        return {
            304: {"description": "the ETag still holds"},
            400: {"model": self.model, "description": "refused; error_message says why"},
            429: {"model": self.model, "description": "this client asks for too much"},
            404: {"model": schema.ErrorMessage, "description": "nothing of the past is kept here"},
            503: {"model": schema.ErrorMessage, "description": "the twin is not there, or busy"},
            504: {"model": schema.ErrorMessage, "description": "the twin did not answer in time"},
        }

    async def refusing(self, answer: Awaitable[Response]) -> Response:
        """Wait for an answer; what stands in its way becomes the answer."""

        async def as_the_service_does() -> Response:
            try:
                return await answer
            except (FieldRefused, PastRefused) as error:
                return json_response(self.refusal_json(str(error)), 400)
            except ClientLimitError as error:
                return json_response(self.refusal_json(str(error)), 429, error.headers)

        return await or_refusal(as_the_service_does())

    def register(
        self, router: APIRouter, answer: Callable[[Request, FieldFormat], Awaitable[Response]]
    ) -> None:
        """Have `/api/<name>.<format>` and `/api/<name>` answered; `answer` may raise refusals."""
        documented: dict[str, Any] = {"openapi_extra": {"parameters": list(self.parameters)}}
        binary = {"schema": {"type": "string", "format": "binary"}}

        @read_route(
            router,
            f"/api/{self.name}",
            summary=f"{self.summary}, in the format that Accept asks for",
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
        async def in_what_accept_allows(request: Request) -> Response:
            field_format = field_query.negotiate(list_header(request, "accept"))
            if field_format is None:
                types = ", ".join(known.media_type for known in FORMATS)
                return error_response(f"Accept allows none of {types}", 406, {"Vary": "Accept"})
            response = await self.refusing(answer(request, field_format))
            response.headers["Vary"] = "Accept"
            return response

        def in_one(field_format: FieldFormat) -> None:
            content = (
                {"model": self.model}
                if field_format is JSON
                else {"content": {field_format.media_type: binary}}
            )

            @read_route(
                router,
                f"/api/{self.name}.{field_format.name}",
                summary=f"{self.summary} as {field_format.name.upper()}",
                responses={200: content, **self.refusals()},
                name=f"{self.name}_{field_format.name}",
                **documented,
            )
            async def in_one_format(request: Request) -> Response:
                return await self.refusing(answer(request, field_format))

        for field_format in FORMATS:
            in_one(field_format)
