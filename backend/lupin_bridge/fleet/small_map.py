"""A site's small map: where its tags are and how each one is, as an SVG of a few hundred bytes.

Pure. The colours are those of the page's `--pin-*`, in light and in dark.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from hashlib import blake2b
from typing import Final

from lupin_bridge.judge.verdict import Health, Verdict, worst
from lupin_twin.core.state import TagState
from lupin_twin.field.grid import reach_of

# Places along each side. Of tags at the same place the worst is drawn, so that no map is larger
# than 7 kB, whatever the site.
_ALONG_X: Final = 40
_ALONG_Y: Final = 20
# Not by colour alone: the worse, the larger.
_STYLE: Final = (
    "path{stroke-linecap:round;stroke-width:1.8}"
    ".critical{stroke:#c4211a;stroke-width:3}.stressed{stroke:#f5a800;stroke-width:2.4}"
    ".healthy{stroke:#1f7a45}.unknown{stroke:#7d8982}"
    "@media(prefers-color-scheme:dark){.critical{stroke:#ff6456}.stressed{stroke:#ffd166}"
    ".healthy{stroke:#52c7b0}}"
)


def dots(tags: Iterable[TagState], healths: Mapping[str, Health]) -> str:
    """A path for each verdict, the worst on top; empty: no tag has a pose.

    A tag that is far off the others is left out, or these would be one dot.
    """
    every = [
        (pose.x, pose.y, healths[tag.tag_id].verdict)
        for tag in tags
        if (pose := tag.pose) is not None and tag.tag_id in healths
    ]
    reach = reach_of((x, y) for x, y, _ in every)
    placed = [one for one in every if reach.holds(*one[:2])]
    if not placed:
        return ""
    left, top = min(x for x, _, _ in placed), max(y for _, y, _ in placed)
    width, height = max(x for x, _, _ in placed) - left, top - min(y for _, y, _ in placed)
    metres = max(width / _ALONG_X, height / _ALONG_Y) or 1.0
    # In the middle; y grows upwards in the map frame, and downwards here.
    right, down = (_ALONG_X - width / metres) / 2, (_ALONG_Y - height / metres) / 2
    drawn: dict[tuple[int, int], Verdict] = {}
    for x, y, verdict in placed:
        at = round((x - left) / metres + right), round((top - y) / metres + down)
        drawn[at] = worst((drawn.get(at, verdict), verdict)) or verdict
    paths = []
    for verdict in reversed(Verdict):
        path = "".join(f"M{x} {y}h0" for (x, y), its in sorted(drawn.items()) if its is verdict)
        if path:
            paths.append(f'<path class="{verdict}" d="{path}"/>')
    return "".join(paths)


def svg(paths: str) -> bytes:
    """The picture of `dots`."""
    box = f"-2 -2 {_ALONG_X + 4} {_ALONG_Y + 4}"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}"><style>{_STYLE}</style>'
    return f"{head}{paths}</svg>".encode()


def version(paths: str) -> str | None:
    """Another one where another map is drawn; None: there is nothing to draw."""
    return blake2b(paths.encode(), digest_size=6).hexdigest() if paths else None
