"""Routes that write: notes of people, readings of programs, devices that want notifications.

The routes that read notes and the audit trail are here too. Posting readings is the only route that
writes to ROS; it is off by default.
"""

from __future__ import annotations

import logging
import math
import time
from contextlib import suppress
from itertools import islice
from typing import Final

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.accounts import Audited, Device
from lupin_bridge.access.credentials import WRITER, AccountError, Person
from lupin_bridge.access.middleware import OBSERVATIONS, PUSH, Access, client_of
from lupin_bridge.alarms.board import NOTE_BURST, NOTES_PER_MINUTE
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.source import ELSEWHERE, TwinUnavailableError
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.notify.push import DeviceRefused, check_device
from lupin_bridge.past.report_page import languages
from lupin_bridge.query_string import OfNotes, moment, read
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    NO_TWIN,
    NOT_REMEMBERED,
    ApiRoute,
    Refused,
    bridge_of,
    computed,
    json_response,
    person_of,
    read_route,
    refusing,
    respond,
    writer_of,
)
from lupin_bridge.routes.pages import language_of
from lupin_bridge.serving.admission import AdmissionError, Answer
from lupin_bridge.stream import routes_schema
from lupin_bridge.stream.state_json import note_json, stamp
from lupin_twin.core.notes import COMMENT, SHELF_S, SHELVE, WITHDRAW, WITHDRAWN, Note, withdrawals
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Observation, Pose

log = logging.getLogger(__name__)

router = APIRouter(default_response_class=Response, route_class=ApiRoute)

MAX_LISTED: Final = 2_000
_TOO_MANY_NOTES: Final = f"written more than {NOTE_BURST} notes and {NOTES_PER_MINUTE} a minute"
# Longest time for which a critical alarm may be shelved; any other one: `SHELF_S`.
CRITICAL_SHELF_S: Final = 3_600
# How far a page's clock may be ahead: it requests an hour from its own now on.
_SLACK_S: Final = 10

_WRITE_ANSWERS: Final = refusing(
    {
        400: "refused; detail has the reason",
        403: "requires an account with the role operator",
        404: "there is no such alarm, tag or note",
        405: "this bridge cannot write notes",
        429: "too many requests from this client",
        503: "the note was not written",
    }
)


@read_route(
    router,
    "/api/notes",
    summary="Notes of people about alarms, tags and the greenhouse",
    responses={200: {"model": routes_schema.Notes}, **NOT_REMEMBERED},
    query=OfNotes,
)
async def notes_route(request: Request) -> Response:
    """Newest first, at most 2,000, including withdrawn ones; the same in every replica."""
    bridge = bridge_of(request)
    given = read(OfNotes, request.query_params.multi_items())
    start_ns, end_ns = given.span(bridge.ros_time_ns)
    key = "notes", bridge.notes.number, given

    def write(notes: tuple[Note, ...]) -> Answer:
        gone = withdrawals(notes)
        found = (
            note_json(note, gone)
            for note in reversed(notes)
            if note.kind != WITHDRAW
            and given.subject in {None, note.subject}
            and start_ns <= note.about_ns
            and (not end_ns or note.about_ns < end_ns)
        )
        body = orjson.dumps({"notes": list(islice(found, MAX_LISTED))})
        return Answer(body, "application/json", NEVER_STORE)

    async def compute() -> Answer:
        notes = await _known(bridge)
        return await computed(bridge, client_of(request), key, lambda _: write(notes), 0.0)

    return await respond(request, key, compute)


@router.post(
    "/api/notes",
    summary="Acknowledge or shelve an alarm, or comment on something",
    status_code=201,
    responses={201: {"model": routes_schema.Note}, **_WRITE_ANSWERS},
)
async def write_note(request: Request, draft: routes_schema.NoteDraft) -> Response:
    """Requires the role operator. Of two notes of one kind on an alarm, the later one counts."""
    bridge = bridge_of(request)
    person = _writer(request, bridge)
    note = await _write(request, bridge, _checked(draft, person, bridge))
    return json_response(orjson.dumps(note_json(note, {})), 201)


@router.delete(
    "/api/notes/{note_id}",
    summary="Withdraw a note; it is kept, with who withdrew it and when",
    responses={200: {"model": routes_schema.Note}, **_WRITE_ANSWERS},
)
async def withdraw_note(request: Request, note_id: str) -> Response:
    """The author or an admin may withdraw a note."""
    bridge = bridge_of(request)
    person = _writer(request, bridge)
    notes = await _known(bridge)
    note = next((note for note in notes if note.id == note_id), None)
    if note is None or note.kind == WITHDRAW:
        raise Refused(f"there is no note {note_id[:64]!r}", 404)
    if note.by != person.name and not person.may("admin"):
        raise Refused(f"the note is by {note.by}: only they or an admin may withdraw it", 403)
    gone = withdrawals(notes)
    if note.id not in gone:
        draft = Note("", _now_ns(bridge), person.name, WITHDRAW, f"{WITHDRAWN}{note.id}")
        gone = {note.id: await _write(request, bridge, draft)}
    return json_response(orjson.dumps(note_json(note, gone)))


# --- who may write, and what ------------------------------------------------------------------


def _writer(request: Request, bridge: Bridge) -> Person:
    """The person who writes; refuses whoever may not."""
    person = writer_of(request)
    if person is None or not person.name:
        raise Refused(
            "notes are written by people: sign in with an account of the role operator "
            "(`lupin-twin user add`)",
            403,
        )
    if not person.may("operator"):
        raise Refused(f"{person.name} is a {person.role}, notes require an operator", 403)
    if not bridge.source.writes_notes:
        raise Refused(ELSEWHERE, 405, {"Allow": "GET, HEAD", **NEVER_STORE})
    return person


async def _known(bridge: Bridge) -> tuple[Note, ...]:
    # If none were read yet, this reads them, or raises why they cannot be read.
    if bridge.notes.notes is None:
        await bridge.notes.look()
    return bridge.notes.notes or ()


def _now_ns(bridge: Bridge) -> int:
    now_ns = bridge.ros_time_ns
    if now_ns is None:
        raise TwinUnavailableError(f"{NO_TWIN}: a note is made at a moment of its clock")
    return now_ns


def _checked(draft: routes_schema.NoteDraft, person: Person, bridge: Bridge) -> Note:
    """The note of a draft; refuses one that is invalid."""
    now_ns = _now_ns(bridge)
    kind, _, name = draft.subject.partition(":")
    is_critical = False
    if kind == "alarm":
        alarm = next((it for it in bridge.alarms.now.alarms if it.id == name), None)
        if alarm is None:
            raise Refused(f"subject: there is no alarm {name[:64]!r}", 404)
        is_critical = alarm.reason.verdict is Verdict.CRITICAL
    elif kind == "tag":
        latest = bridge.latest
        if latest is None or all(tag.tag_id != name for tag in latest.snapshot.tags):
            raise Refused(f"subject: there is no tag {name[:64]!r}", 404)
    elif draft.subject != "site":
        raise Refused(f"subject is {draft.subject[:64]!r}, expected alarm:ID, tag:ID or site")
    if draft.kind != COMMENT and kind != "alarm":
        raise Refused(f"kind is {draft.kind!r}, which is for alarms: expected comment")
    if draft.kind == COMMENT and not draft.text:
        raise Refused("text is empty, a comment must have one")
    until_ns = _until(draft, now_ns, is_critical=is_critical)
    return Note("", now_ns, person.name, draft.kind, draft.subject, draft.text, until_ns)


def _until(draft: routes_schema.NoteDraft, now_ns: int, *, is_critical: bool) -> int | None:
    """When shelving ends, or the moment of a comment, ns; None: it ends now, or is about now."""
    if draft.kind == SHELVE and "until" not in draft.model_fields_set:
        raise Refused("until is missing, expected a moment, or null to unshelve")
    if draft.until is None:
        return None
    until_ns = _given_ns("until", draft.until)
    left_s = (until_ns - now_ns) / NANOSECONDS_PER_SECOND
    if draft.kind == COMMENT:
        if left_s > _SLACK_S:
            raise Refused(f"until is in {left_s:.0f} s, a comment cannot be about a later moment")
        return until_ns
    if draft.kind != SHELVE:
        raise Refused("until is for the kinds shelve and comment")
    if is_critical and not draft.text:
        raise Refused("text is empty: shelving a critical alarm requires a reason")
    longest_s = CRITICAL_SHELF_S if is_critical else SHELF_S
    if not 0.0 < left_s <= longest_s + _SLACK_S:
        what = "a critical alarm" if is_critical else "an alarm"
        raise Refused(
            f"until is in {left_s:.0f} s, {what} is shelved for more than 0 and at most "
            f"{longest_s} s"
        )
    return min(until_ns, now_ns + longest_s * NANOSECONDS_PER_SECOND)


async def _write(request: Request, bridge: Bridge, note: Note) -> Note:
    bridge.notes.pace.charge(note.by, time.monotonic(), _TOO_MANY_NOTES)
    access: Access = request.app.state.access
    written = await bridge.source.write_note(note)
    # It is in the log: no failure from here on may report that it is not.
    with suppress(NotRemembered, PastRefused, TwinUnavailableError):
        await bridge.notes.look()
    if access.people is not None and access.people.has_file:
        try:
            done = note.by, note.kind, note.subject, client_of(request)
            await access.people.write(lambda it, now_s: it.note(Audited(now_s, *done)))
        except (AccountError, AdmissionError) as error:
            log.warning("the note %s is not in the audit trail: %s", written.id, error)
    return written


@read_route(
    router,
    "/api/audit",
    summary="Who signed in, and who changed what",
    responses={
        200: {"model": routes_schema.Audit},
        **refusing({403: "requires the role admin", 503: "the accounts cannot be read"}),
    },
)
async def audit_route(request: Request) -> Response:
    """Newest first, at most 2,000 entries; `lupin-twin audit` prints all of them."""
    access, person = request.app.state.access, person_of(request)
    if person is None or not person.may("admin") or access.people is None:
        raise Refused("the audit trail is for the role admin", 403)
    found = await access.people.write(lambda it, _: it.audited(MAX_LISTED))
    return json_response(orjson.dumps({"audit": [row._asdict() for row in found]}))


# --- readings of programs -------------------------------------------------------------------------

# How far a clock may be ahead; a stamp farther ahead comes from a wrong clock.
MAX_AHEAD_S: Final = 10


@router.post(
    OBSERVATIONS,
    summary="Post the readings of one tag, which reach the twin over ROS, as a robot's do",
    status_code=202,
    responses={
        202: {"model": routes_schema.PublishedObservation, "description": "published over ROS"},
        **refusing(
            {
                400: "refused; detail has the reason",
                403: "requires a token with the role writer, and a bridge with "
                "--http-observations on",
                429: "too many requests from this client",
                503: "the twin is silent",
            }
        ),
    },
)
async def post_observation(request: Request, draft: routes_schema.ObservationDraft) -> Response:
    """Requires a token with the role writer. The same tag at the same `observed_at` counts once.

    The twin applies its own rules, and reports on `/diagnostics` what it drops.
    """
    bridge, person = bridge_of(request), writer_of(request)
    if person is None or person.role != WRITER:
        raise Refused(
            f"observations require a token of the role {WRITER} "
            f"(`lupin-twin token add NAME --role {WRITER}`), as Authorization: Bearer",
            403,
        )
    if not bridge.takes_observations:
        raise Refused(
            "this bridge takes no observations: start serve or web with --http-observations on", 403
        )
    limits = bridge.limits
    most = f"{limits.observation_burst} observations and {limits.observations_per_s:g} a second"
    bridge.observations_pace.charge(person.name, time.monotonic(), f"posted more than {most}")
    now_ns = bridge.ros_time_ns
    if now_ns is None or not bridge.status.is_live:
        raise TwinUnavailableError("the twin is silent: post it again later")
    stamp_ns = _stamp_ns(draft.observed_at, now_ns)
    pose = None if draft.place is None else Pose.at(*draft.place)
    source = f"http/{person.name}"
    await bridge.source.publish_observation(
        Observation(draft.tag_id, stamp_ns, draft.readings, pose, source=source)
    )
    body = {"tag_id": draft.tag_id, "observed_at": stamp(stamp_ns), "source": source}
    return json_response(orjson.dumps(body), 202)


def _given_ns(name: str, given: str | float) -> int:
    return moment(name, given if isinstance(given, str) else f"{given:.6f}")


def _stamp_ns(observed_at: str | float | None, now_ns: int) -> int:
    if observed_at is None:
        return now_ns
    stamp_ns = _given_ns("observed_at", observed_at)
    ahead_s = (stamp_ns - now_ns) / NANOSECONDS_PER_SECOND
    if ahead_s > MAX_AHEAD_S:
        raise Refused(
            f"observed_at is {math.ceil(ahead_s)} s ahead of ROS time, the limit is "
            f"{MAX_AHEAD_S} s: is a clock wrong?"
        )
    if not stamp_ns:
        raise Refused("observed_at is 0, which is not a moment: omit it for the current time")
    return min(stamp_ns, now_ns)


# --- devices of people that want notifications of critical alarms (Web Push) ----------------------


@read_route(
    router,
    PUSH,
    summary="The key with which a browser subscribes to notifications",
    responses={200: {"model": routes_schema.PushKey}},
)
async def key_route(request: Request) -> Response:
    """Only people with an account get a key, and only if the bridge has `--push-contact`."""
    push, person = bridge_of(request).outward.push, person_of(request)
    people = request.app.state.access.people
    key = None
    if push is not None and person is not None and people.has_account(person):
        key = await push.public_key()
    return json_response(orjson.dumps({"public_key": key}))


@router.post(
    PUSH,
    summary="Turn notifications of critical alarms on or off for a browser",
    status_code=204,
    responses={
        204: {"description": "done"},
        **refusing(
            {
                400: "refused; detail has the reason",
                403: "requires an account",
                404: "Web Push is not set up on this bridge",
                429: "too many requests from this client",
            }
        ),
    },
)
async def subscribe(request: Request, given: routes_schema.PushSubscription) -> Response:
    """An account may have ten browsers; an eleventh replaces the oldest."""
    push, person = bridge_of(request).outward.push, writer_of(request)
    access: Access = request.app.state.access
    if push is None or access.people is None:
        raise Refused("this bridge has no Web Push: start it with --push-contact", 404)
    # The devices of a token could not be removed with an account.
    if person is None or not access.people.has_account(person):
        raise Refused("notifications require an account: sign in by name", 403)
    bridge_of(request).notes.pace.charge(person.name, time.monotonic(), _TOO_MANY_NOTES)
    if given.keys is None:
        await access.people.write(lambda it, _: it.remove_device(given.endpoint, person.name))
        return Response(status_code=204, headers=NEVER_STORE)
    language = language_of(request, languages())
    device = Device(given.endpoint, given.keys.p256dh, given.keys.auth, language)
    try:
        check_device(device, push.target)
    except DeviceRefused as error:
        raise Refused(str(error)) from None
    address = client_of(request)
    await access.people.write(lambda it, now_s: it.add_device(person.name, device, address, now_s))
    return Response(status_code=204, headers=NEVER_STORE)
