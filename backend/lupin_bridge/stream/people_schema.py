"""What the routes of people carry, as types; see `schema`."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from lupin_bridge.stream.schema import Contract, Time
from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TEXT_LENGTH

# Of a note, characters; no control character but tab and newline is in it.
MAX_TEXT: Final = 500
_Text = Annotated[
    str,
    StringConstraints(
        max_length=MAX_TEXT, strip_whitespace=True, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f]*$"
    ),
]
Role = Literal["viewer", "operator", "admin"]

# A text of ROS ends at its first NUL.
_Name = Annotated[
    str,
    StringConstraints(
        min_length=1, max_length=MAX_TEXT_LENGTH, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$"
    ),
]


class _Given(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class SignIn(_Given):
    """The body of `POST /api/signin`, of an account."""

    name: str
    password: str
    ends_others: bool = Field(default=False, description="sign this name out everywhere else")


class _Keys(_Given):
    p256dh: str = Field(max_length=100, description="of the browser, base64url (RFC 8291)")
    auth: str = Field(max_length=30, description="of the browser, base64url (RFC 8291)")


class PushSubscription(_Given):
    """The body of `POST /api/push`: a browser's own, as its `toJSON()` gives it."""

    endpoint: str = Field(max_length=1_000, description="the push service's address")
    keys: _Keys | None = Field(default=None, description="null: notify it no more")
    expirationTime: float | None = None  # noqa: N815  # as browsers write it


class PushKey(Contract):
    """`/api/push`: whether notifications can be had, and by which key."""

    public_key: str | None = Field(description="base64url; null: not here, or not for them")


class NoteDraft(_Given):
    """The body of `POST /api/notes`."""

    kind: Literal["acknowledge", "shelve", "comment"]
    subject: str = Field(
        max_length=300, description="`alarm:` and its id, `tag:` and its id, or `site`"
    )
    text: _Text = Field(default="", description=f"at most {MAX_TEXT} characters")
    until: str | None = Field(
        default=None,
        max_length=64,
        description="as `at`. Of shelve, its end; null: not any more. Of comment, the moment that "
        "it is about; null: now",
    )


class ObservationDraft(_Given):
    """The body of `POST /api/observations`: what one tag's sensors read at one moment."""

    tag_id: _Name
    readings: dict[_Name, Annotated[float, Field(allow_inf_nan=False)]] = Field(
        min_length=1, max_length=MAX_SENSORS_PER_TAG, description="by sensor, in its own unit"
    )
    observed_at: str | float | None = Field(
        default=None, description="ISO 8601 or ROS seconds, as `at`; null: now"
    )
    place: list[Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]] | None = Field(
        default=None,
        min_length=2,
        max_length=3,
        description="x, y and z of the tag, m; the first place stays",
    )


class PublishedObservation(Contract):
    """What was published of it."""

    tag_id: str
    observed_at: Time
    source: str = Field(description="`http/` and the name of the token")


class Note(Contract):
    """What somebody wrote; it is never changed. Times are ROS time."""

    id: str = Field(description="opaque")
    kind: Literal["acknowledge", "shelve", "comment"]
    subject: str
    text: str
    until: Time | None = Field(
        description="of shelve, its end; null: not any more. Of comment, the moment that it is "
        "about; null: `made_at`"
    )
    made_at: Time
    by: str = Field(description="name of an account or of a token")
    withdrawn_by: str | None = Field(description="null: it stands")
    withdrawn_at: Time | None


class Notes(Contract):
    """`/api/notes`."""

    notes: list[Note] = Field(description="newest first")


class Session(Contract):
    """`/api/session`: who makes the request, and whether `/api/signout` would end a session."""

    can_sign_out: bool
    seconds_left: float | None = Field(description="of the session; null: there is none")
    name: str | None = Field(description="null: nobody that is known by name")
    role: Role
    can_write_notes: bool = Field(description="whether `POST /api/notes` is for them, and is here")


class AuditRow(Contract):
    """Who did what to what, from where, and when."""

    at_s: int = Field(description="s since the epoch, by the wall's clock")
    who: str
    what: str
    subject: str
    address: str


class Audit(Contract):
    """`/api/audit`."""

    audit: list[AuditRow] = Field(description="newest first")
