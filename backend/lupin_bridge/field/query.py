"""A field's query string, format, ETag and headers. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Final, Literal
from urllib.parse import quote

from annotated_types import Gt, Interval

from lupin_bridge.field.formats import FORMATS, JSON, PNG, FieldFormat
from lupin_bridge.query_string import AT, Name, needed, parameter, safe_name
from lupin_twin.field.engine import (
    DEFAULT_RESOLUTION_M,
    FieldRefused,
    FieldRequest,
    default_request,
)

BOX_NAMES: Final = ("bbox_min_x", "bbox_min_y", "bbox_max_x", "bbox_max_y")
_BOX: Final = "m, map frame; without a box: all pinned tags but those far off, and their reach"

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class FieldQuery:
    """The parameters of a field; `resolution` and the box are None where left to the server."""

    sensor_type: Name = needed("name of a sensor, as in a reading")
    resolution: Annotated[float, Gt(0)] | None = parameter(
        "m, side of a square cell; without a box either: doubled until the field is small enough; "
        f"default: {DEFAULT_RESOLUTION_M}"
    )
    bbox_min_x: float | None = parameter(_BOX)
    bbox_min_y: float | None = parameter(_BOX)
    bbox_max_x: float | None = parameter(_BOX)
    bbox_max_y: float | None = parameter(_BOX)
    scale: Annotated[int, Interval(ge=1, le=1000)] = parameter(
        "PNG only: pixels a cell along each side", 1
    )
    at: str | None = parameter(AT)

    @property
    def box(self) -> Box | None:
        """The box, where one is given.

        Raises:
            FieldRefused: not all of it is.

        """
        box = self.bbox_min_x, self.bbox_min_y, self.bbox_max_x, self.bbox_max_y
        missing = [name for name, value in zip(BOX_NAMES, box, strict=True) if value is None]
        if missing and len(missing) < len(box):
            raise FieldRefused(f"the box is incomplete: {', '.join(missing)} is missing")
        return None if missing else box  # type: ignore[return-value]  # all of it is there

    def request(self, default_box: Box, max_cells: int) -> FieldRequest:
        """The request for GetField; one with neither box nor resolution has `max_cells` at most.

        Raises:
            FieldRefused: see `box`.

        """
        box = self.box
        if box is None and self.resolution is None:
            return default_request(self.sensor_type, default_box, max_cells)
        resolution = DEFAULT_RESOLUTION_M if self.resolution is None else self.resolution
        return FieldRequest(self.sensor_type, resolution, *(box or default_box))


@dataclass(frozen=True, slots=True)
class EstimateQuery(FieldQuery):
    """Those of an estimate: it is two numbers a cell, and a picture shows one of them."""

    layer: Literal["mean", "sd"] = parameter(
        "PNG only: which of the two numbers; transparent where the estimate is not known", "mean"
    )


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
    ranges = weighted(accept)
    best, best_weight = None, 0.0
    for candidate in FORMATS:
        weight = _weight(candidate.media_type, ranges)
        if weight > best_weight:
            best, best_weight = candidate, weight
    return best


def weighted(header: str) -> list[tuple[str, float]]:
    """What a header accepts, in lower case, and each one's weight (RFC 9110, section 12.4.2).

    What is no weight counts as 0.
    """
    found = []
    for part in header.lower().split(","):
        name, *options = (piece.strip() for piece in part.split(";"))
        weight = 1.0
        for option in options:
            key, _, value = option.partition("=")
            if key.strip() == "q":
                try:
                    weight = min(1.0, max(0.0, float(value)))
                except ValueError:
                    weight = 0.0
        found.append((name, weight if weight == weight else 0.0))  # noqa: PLR0124  # NaN
    return found


def _weight(media_type: str, ranges: Iterable[tuple[str, float]]) -> float:
    main_type = media_type.partition("/")[0]
    by_specificity = {media_type: 3, f"{main_type}/*": 2, "*/*": 1}
    found = [(by_specificity[name], weight) for name, weight in ranges if name in by_specificity]
    return max(found)[1] if found else 0.0


def matches(if_none_match: str | None, tag: str) -> bool:
    """Whether an If-None-Match header names this ETag (RFC 9110, section 13.1.2: weakly)."""
    if not if_none_match:
        return False
    candidates = [part.strip() for part in if_none_match.split(",")]
    return "*" in candidates or tag in [part.removeprefix("W/") for part in candidates]


def headers(metadata: Mapping[str, str], file_name: str, kind: str = "Field") -> dict[str, str]:
    """A field's metadata as `X-Field-…` headers, and a name for who saves it.

    Header values are ASCII and neither begin nor end with a space; what is not so is
    percent-encoded as UTF-8.
    """
    result = {f"X-{kind}-{name}": _header_value(value) for name, value in metadata.items()}
    result["Content-Disposition"] = f'inline; filename="{safe_name(file_name)}"'
    return result


def _header_value(text: str) -> str:
    value = quote(text, safe=_SAFE)
    return _OUTER_SPACES.sub(lambda spaces: "%20" * len(spaces[0]), value)


_OUTER_SPACES: Final = re.compile(r"^ +| +$")
_SAFE: Final = " !#$&'()*+,-./:;<=>?@[]^_`{|}~"
