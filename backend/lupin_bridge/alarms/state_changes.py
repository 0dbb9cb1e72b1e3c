"""What was observed, told by two states one behind the other: where no journal tells. Pure."""

from __future__ import annotations

from dataclasses import replace

from lupin_twin.core.history import KIND_FLOWER, KIND_TAG_READING
from lupin_twin.core.past import PastWrite
from lupin_twin.core.state import STATUS_OK, Snapshot, TagState, sure_species

# The one run of the clock that is told of here.
RUN = 0
_UNKNOWN = TagState("")


def writes_between(before: Snapshot | None, now: Snapshot, number: int) -> list[PastWrite]:
    """The scans, looks and failed tries that are new, numbered from `number` on.

    Of tries of one tag that lie closer together than two states, all but the last may be missed,
    and one that failed counts as one at its sensors.
    """
    known = {} if before is None else {tag.tag_id: tag for tag in before.tags}
    found = [
        write
        for tag in now.tags
        if (old := known.get(tag.tag_id, _UNKNOWN)) is not tag
        for write in _of_tag(old, tag)
    ]
    return [replace(write, number=number + index) for index, write in enumerate(found)]


def _of_tag(before: TagState, tag: TagState) -> list[PastWrite]:
    """In the order of time."""
    found: list[PastWrite] = []
    known = {(reading.name, reading.observed_at_ns) for reading in before.readings}
    scans: dict[int, list[tuple[str, float]]] = {}
    for reading in tag.readings:
        at_ns = reading.observed_at_ns
        if at_ns is not None and (reading.name, at_ns) not in known:
            scans.setdefault(at_ns, []).append((reading.name, reading.value))
    for at_ns, readings in scans.items():
        names, values = zip(*readings, strict=True)
        scan = PastWrite(0, RUN, tag.tag_id, at_ns, KIND_TAG_READING, STATUS_OK, names, values)
        found.append(scan)
    at_ns = tag.looked_at_ns
    if at_ns is not None and (at_ns, tag.flower) != (before.looked_at_ns, before.flower):
        flower = tag.flower
        species = sure_species(flower.species, flower.confidence)
        seen = (True, species, flower.anomaly, flower.bug_count)
        look = PastWrite(0, RUN, tag.tag_id, at_ns, KIND_FLOWER, STATUS_OK, (), (), *seen)
        found.append(look)
    last = tag.last_try
    if last is not None and last.status != STATUS_OK and last != before.last_try:
        failed = PastWrite(0, RUN, tag.tag_id, last.stamp_ns, KIND_TAG_READING, last.status)
        found.append(failed)
    return sorted(found, key=lambda write: write.stamp_ns)
