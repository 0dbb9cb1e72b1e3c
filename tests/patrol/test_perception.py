"""Discovery of tags."""

from math import cos, radians, sin

import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.greenhouse import Greenhouse, Point, Rect, Table, Tag, read_greenhouse
from lupin_patrol.perception import TAG_RANGE_M, Plants, TagDetector

TABLE = Table("one", Rect(1.0, 1.0, 2.0, 2.0))
TAG = Tag("7", (1.05, 1.5), ("co2",), TABLE, (1.0, 1.5), (-1.0, 0.0), (0.6, 1.5))
HALL = Greenhouse(Rect(0.0, 0.0, 4.0, 4.0), (TABLE,), (TAG,))


def sees(position: Point) -> bool:
    return TagDetector(HALL, Plants(HALL, 0), 0).observe_from(position, 0)


def in_front(angle_deg: float, away_m: float) -> Point:
    """A position before the tag, that far off its normal."""
    angle = radians(angle_deg)
    return TAG.edge[0] - away_m * cos(angle), TAG.edge[1] + away_m * sin(angle)


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        (in_front(0, 0.4), True),
        (in_front(0, TAG_RANGE_M - 0.02), True),
        (in_front(0, TAG_RANGE_M + 0.02), False),
        (in_front(60, 0.5), True),
        (in_front(-60, 0.5), True),
        (in_front(75, 0.5), False),
        ((2.4, 1.5), False),  # behind the table
        ((1.5, 2.4), False),  # beside it
    ],
)
def test_a_tag_is_seen_from_near_and_from_its_front(position: Point, expected: bool) -> None:
    assert sees(position) is expected


def test_every_tag_is_seen_from_its_stop_in_the_order_of_the_inspections() -> None:
    greenhouse = read_greenhouse(GreenhouseSimulator())
    plants = Plants(greenhouse, 0)
    for tag in greenhouse.tags:
        detector = TagDetector(greenhouse, plants, 0)
        assert detector.observe_from(tag.stop, 0)
        assert tag in [sighting.tag for sighting in detector.sightings()]
    detector = TagDetector(greenhouse, plants, 0)
    stops = {tag.tag_id: tag.stop for tag in greenhouse.tags}
    for tag_id in ("2", "21"):
        detector.observe_from(stops[tag_id], 0)
    found = [sighting.tag.tag_id for sighting in detector.sightings()]
    assert found.index("2") < found.index("21")


def test_a_pest_is_suspected_while_it_is_there() -> None:
    greenhouse = read_greenhouse(GreenhouseSimulator())
    plants = Plants(greenhouse, 0)
    detector = TagDetector(greenhouse, plants, 0)
    for pass_index in range(6):
        for tag in greenhouse.tags:
            detector.observe_from(tag.stop, pass_index)
        assert {s.tag.tag_id for s in detector.sightings() if s.anomaly} == {
            tag.tag_id for tag in greenhouse.tags if plants.bugs(tag.tag_id, pass_index)
        }
