"""A field's query string and headers: what was asked, in which format, and under which ETag.

Pure. A query is refused, never guessed at: an unknown or repeated parameter is a typing error that
would otherwise go unseen.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final
from urllib.parse import quote

from lupin_bridge.field.formats import FORMATS, JSON, PNG, FieldFormat
from lupin_bridge.query_string import values_of
from lupin_twin.fields import (
    DEFAULT_RESOLUTION_M,
    FieldRefused,
    FieldRequest,
    default_request,
)

BOX_NAMES: Final = ("bbox_min_x", "bbox_min_y", "bbox_max_x", "bbox_max_y")
NAMES: Final = ("sensor_type", "resolution", *BOX_NAMES, "scale", "at")
# An estimate is two numbers a cell, a picture shows one of them.
LAYERS: Final = ("mean", "sd")
ESTIMATE_NAMES: Final = (*NAMES, "layer")
_PLAIN: Final = re.compile(r"[0-9A-Za-z+.-]+")

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class FieldQuery:
    """What a query string asks for; `resolution` and `box` are None where left to the server.

    `at` is a moment as it was sent, None for now; `layer`, of an estimate's picture, one of
    `LAYERS`.
    """

    sensor_type: str
    resolution: float | None
    box: Box | None
    scale: int
    at: str | None = None
    layer: str = LAYERS[0]

    def request(self, default_box: Box, max_cells: int) -> FieldRequest:
        """The query as GetField's request; one that asks for neither has `max_cells` at most."""
        if self.box is None and self.resolution is None:
            return default_request(self.sensor_type, default_box, max_cells)
        resolution = DEFAULT_RESOLUTION_M if self.resolution is None else self.resolution
        return FieldRequest(self.sensor_type, resolution, *(self.box or default_box))


def parse(parameters: Sequence[tuple[str, str]], names: Sequence[str] = NAMES) -> FieldQuery:
    """Read a query string's (name, value) pairs; `names` are those that it may have.

    Raises:
        FieldRefused: an unknown or repeated parameter, an incomplete box, not a number, no layer.

    """
    values = values_of(parameters, names, FieldRefused)
    given = [name for name in BOX_NAMES if name in values]
    box: Box | None = None
    if given:
        missing = [name for name in BOX_NAMES if name not in values]
        if missing:
            raise FieldRefused(f"the box is incomplete: {', '.join(missing)} is missing")
        min_x, min_y, max_x, max_y = (_number(name, values[name]) for name in BOX_NAMES)
        box = (min_x, min_y, max_x, max_y)
    return FieldQuery(
        sensor_type=values.get("sensor_type", ""),
        resolution=(
            _number("resolution", values["resolution"]) if "resolution" in values else None
        ),
        box=box,
        scale=_scale(values.get("scale", "1")),
        at=values.get("at"),
        layer=_layer(values.get("layer", LAYERS[0])),
    )


def plain_number(text: str) -> float | None:
    """A number in a query string; None: it is none.

    float() takes more than plain numbers: `1_000`, and the digits of every script. Blanks around
    are fine: in a query string, `+2` reads ` 2`.
    """
    if _PLAIN.fullmatch(text.strip(" ")):
        with suppress(ValueError):
            return float(text)
    return None


def _number(name: str, text: str) -> float:
    number = plain_number(text)
    if number is None:
        raise FieldRefused(f"{name} is {text[:64]!r}, expected a number")
    return number


def _scale(text: str) -> int:
    if not (text.isascii() and text.isdigit() and 1 <= int(text[:6]) <= 1000 and len(text) <= 6):
        raise FieldRefused(f"scale is {text[:64]!r}, expected a whole number from 1 to 1000")
    return int(text)


def _layer(text: str) -> str:
    if text not in LAYERS:
        raise FieldRefused(f"layer is {text[:64]!r}, expected one of {', '.join(LAYERS)}")
    return text


def check_scale(query: FieldQuery, field_format: FieldFormat, cells: int, max_cells: int) -> None:
    """Refuse a scale for anything but a picture, and a picture past the cell limit.

    Raises:
        FieldRefused: either of the two.

    """
    if query.scale == 1:
        return
    if field_format != PNG:
        raise FieldRefused(f"scale is {query.scale}, but only a PNG can be scaled")
    pixels = cells * query.scale**2
    if pixels > max_cells:
        raise FieldRefused(
            f"scale {query.scale} makes a picture of {pixels} pixels, the limit is {max_cells}"
        )


def negotiate(accept: str | None) -> FieldFormat | None:
    """The format that an Accept header prefers, JSON where it is open; None: none will do.

    RFC 9110, section 12.5.1: the most specific range that matches a format gives its weight.
    """
    if not accept or not accept.strip():
        return JSON
    ranges = [_media_range(part) for part in accept.split(",") if part.strip()]
    best, best_weight = None, 0.0
    for candidate in FORMATS:
        weight = _weight(candidate.media_type, ranges)
        if weight > best_weight:
            best, best_weight = candidate, weight
    return best


def _media_range(text: str) -> tuple[str, float]:
    media_type, *parameters = (part.strip().lower() for part in text.split(";"))
    weight = 1.0
    for parameter in parameters:
        name, _, value = parameter.partition("=")
        if name.strip() == "q":
            try:
                weight = min(1.0, max(0.0, float(value)))
            except ValueError:
                weight = 0.0
    return media_type, weight if weight == weight else 0.0  # noqa: PLR0124  # NaN


def _weight(media_type: str, ranges: Iterable[tuple[str, float]]) -> float:
    main_type = media_type.partition("/")[0]
    by_specificity = {media_type: 3, f"{main_type}/*": 2, "*/*": 1}
    found = [(by_specificity[name], weight) for name, weight in ranges if name in by_specificity]
    return max(found)[1] if found else 0.0


def etag(revision: str, request: FieldRequest, kind: str, scale: int) -> str:
    """The strong ETag of a field: of the revision and of all that was asked for."""
    numbers = (
        request.resolution,
        request.bbox_min_x,
        request.bbox_min_y,
        request.bbox_max_x,
        request.bbox_max_y,
    )
    text = repr((revision, request.sensor_type, numbers, kind, scale))
    return f'"{hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=12).hexdigest()}"'


def matches(if_none_match: str | None, tag: str) -> bool:
    """Whether an If-None-Match header names this ETag (RFC 9110, section 13.1.2: weakly)."""
    if not if_none_match:
        return False
    candidates = [part.strip() for part in if_none_match.split(",")]
    return "*" in candidates or tag in [part.removeprefix("W/") for part in candidates]


def headers(metadata: Mapping[str, str], file_name: str, kind: str = "Field") -> dict[str, str]:
    """A field's metadata as `X-Field-…` headers, and a name for who saves it.

    Header values are ASCII and neither begin nor end with a space; what is not so is
    percent-encoded as UTF-8. In the file's name, anything that a file system or a shell could take
    amiss becomes an underscore.
    """
    result = {f"X-{kind}-{name}": _header_value(value) for name, value in metadata.items()}
    result["Content-Disposition"] = f'inline; filename="{_UNSAFE_IN_NAME.sub("_", file_name)}"'
    return result


def _header_value(text: str) -> str:
    value = quote(text, safe=_SAFE)
    return _OUTER_SPACES.sub(lambda spaces: "%20" * len(spaces[0]), value)


_OUTER_SPACES: Final = re.compile(r"^ +| +$")
_SAFE: Final = " !#$&'()*+,-./:;<=>?@[]^_`{|}~"
_UNSAFE_IN_NAME: Final = re.compile(r"[^A-Za-z0-9._-]")
