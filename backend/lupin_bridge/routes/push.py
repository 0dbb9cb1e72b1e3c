"""Devices of people that want notifications of critical alarms (Web Push)."""

from __future__ import annotations

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.accounts import Device
from lupin_bridge.access.middleware import PUSH, Access, client_of
from lupin_bridge.access.person import Person
from lupin_bridge.notify.push import DeviceRefused, check_device
from lupin_bridge.past.report_page import languages
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    TOO_MUCH,
    BodyRefused,
    bridge_of,
    error_response,
    json_response,
    list_header,
    person_of,
    read_body,
    read_route,
)
from lupin_bridge.routes.notes import pace_note
from lupin_bridge.routes.pages import language_of
from lupin_bridge.stream import people_schema, schema

router = APIRouter()


@read_route(
    router,
    PUSH,
    summary="The key that a browser subscribes to notifications with",
    responses={200: {"model": people_schema.PushKey}},
)
async def key_route(request: Request) -> Response:
    """For people with an account, where the bridge has `--push-contact`."""
    push, person = bridge_of(request).outward.push, person_of(request)
    key = None
    if push is not None and person is not None and _has_account(request, person):
        key = await push.public_key()
    return json_response(orjson.dumps({"public_key": key}))


@router.post(
    PUSH,
    summary="Have a browser notified of critical alarms, or not any more",
    status_code=204,
    response_class=Response,
    responses={
        204: {"description": "done"},
        400: {"model": schema.ErrorMessage, "description": "refused; detail has the reason"},
        403: {"model": schema.ErrorMessage, "description": "it takes an account"},
        404: {"model": schema.ErrorMessage, "description": "this bridge has no Web Push"},
        **TOO_MUCH,
    },
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {"schema": {"$ref": "#/components/schemas/PushSubscription"}}
            },
        }
    },
)
async def subscribe(request: Request) -> Response:
    """Ten browsers of an account at most: the oldest makes room."""
    push, person = bridge_of(request).outward.push, person_of(request)
    access: Access = request.app.state.access
    if push is None or access.people is None:
        return error_response("this bridge has no Web Push: start it with --push-contact", 404)
    if person is None or not _has_account(request, person):
        return error_response("notifications take an account: sign in by name", 403)
    pace_note(bridge_of(request), person.name)
    given = await read_body(request, people_schema.PushSubscription)
    if given.keys is None:
        await access.people.write(lambda it, _: it.remove_device(given.endpoint, person.name))
        return Response(status_code=204, headers=NEVER_STORE)
    language = language_of(None, list_header(request, "accept-language"), languages())
    device = Device(given.endpoint, given.keys.p256dh, given.keys.auth, language)
    try:
        check_device(device, push.target)
    except DeviceRefused as error:
        raise BodyRefused(str(error)) from None
    address = client_of(request)
    await access.people.write(lambda it, now_s: it.add_device(person.name, device, address, now_s))
    return Response(status_code=204, headers=NEVER_STORE)


def _has_account(request: Request, person: Person) -> bool:
    """Not a token's or the shared token's: what they have could not be ended with an account."""
    people = request.app.state.access.people
    return people is not None and people.has_account(person)
