"""The patrol as a whole: a repeatable sequence of events; its map, its plants and pests."""

import random
from collections.abc import Iterator
from itertools import pairwise
from math import dist
from typing import TypeVar

import numpy as np
import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.greenhouse import TABLE_HEIGHT_M, Greenhouse, Point, Rect, read_greenhouse
from lupin_patrol.mission import (
    DOCK,
    START_OF_DAY_S,
    Event,
    MapGrown,
    Mission,
    PassCompleted,
    RobotMoved,
    ScanStatus,
    TagsDiscovered,
    Visited,
)
from lupin_patrol.perception import (
    FREE,
    OCCUPIED,
    RESOLUTION_M,
    SPECIES,
    UNKNOWN,
    VIEW_RADIUS_M,
    Exploration,
    Grid,
    Plants,
)
from lupin_twin.core.state import Observation
from tests.support.climate import known_in

DEFAULT_SEED = 0
DAY_SPEED = 60.0
PASSES = 6

EventT = TypeVar("EventT", bound=Event)


def played(seed: int = DEFAULT_SEED, passes: int = 1, day_speed: float = DAY_SPEED) -> list[Event]:
    return list(until(passes, Mission(GreenhouseSimulator(), seed, day_speed).events()))


def until(passes: int, events: Iterator[Event]) -> Iterator[Event]:
    for event in events:
        yield event
        if isinstance(event, PassCompleted) and event.pass_index == passes - 1:
            return


def only(kind: type[EventT], events: list[Event]) -> list[EventT]:
    return [event for event in events if isinstance(event, kind)]


def scans_of(events: list[Event]) -> list[Observation]:
    return [visit.write for visit in only(Visited, events) if not visit.write.kind]


@pytest.fixture(scope="module")
def patrol() -> list[Event]:
    return played(passes=PASSES)


@pytest.fixture(scope="module")
def many_first_passes() -> list[list[Event]]:
    return [played(seed) for seed in range(4)]


def test_the_same_seed_gives_the_same_events(patrol: list[Event]) -> None:
    random.seed(2026)  # the simulator uses the global random generator
    assert played(passes=PASSES) == patrol


def test_the_map_grows_and_never_forgets(patrol: list[Event]) -> None:
    grids = [event.grid for event in only(MapGrown, list(until(1, iter(patrol))))]
    assert len(grids) > 10
    for before, after in pairwise(grids):
        assert known_in(after) > known_in(before)
        old, new = (np.frombuffer(grid.cells, dtype=np.int8) for grid in (before, after))
        assert (new[old != -1] == old[old != -1]).all()


def test_a_tag_is_discovered_before_its_first_attempt(many_first_passes: list[list[Event]]) -> None:
    for events in many_first_passes:
        discovered: set[str] = set()
        for event in events:
            if isinstance(event, TagsDiscovered):
                discovered = {tag.tag_id for tag in event.tags}
            elif isinstance(event, Visited):
                assert event.write.tag_id in discovered


def test_every_tag_is_read_within_a_minute_with_its_retries(
    many_first_passes: list[list[Event]],
) -> None:
    for events in many_first_passes:
        scans = scans_of(events)
        assert len({scan.tag_id for scan in scans if scan.status == ScanStatus.OK}) == 29
        [completed] = only(PassCompleted, events)
        assert completed.failed == ()
        # Patrol time: at the default speed one second is one second. Five seconds are left for
        # the start of the process and DDS discovery.
        assert completed.at_s <= 55.0


def test_readings_have_the_units_of_the_contract(patrol: list[Event]) -> None:
    plausible = {
        "temperature": (0.0, 40.0),
        "humidity": (10.0, 100.0),
        "co2": (300.0, 1_000.0),
        "light": (500.0, 1_200.0),
        "soil_moisture": (20.0, 100.0),
    }
    for scan in scans_of(patrol):
        for name, value in scan.readings.items():
            low, high = plausible[name]
            assert low < value < high, name


def test_a_retry_may_fail_too_and_a_later_round_reads_the_tag(patrol: list[Event]) -> None:
    lost = [(done.pass_index, tag) for done in only(PassCompleted, patrol) for tag in done.failed]
    assert lost
    for pass_index, tag_id in lost:
        in_pass = [
            visit.write.status
            for visit in only(Visited, patrol)
            if visit.write.tag_id == tag_id and visit.pass_index == pass_index
        ]
        assert len(in_pass) == 2
        assert ScanStatus.OK not in in_pass
    pass_index, tag_id = lost[0]
    assert any(
        visit.write.status == ScanStatus.OK
        for visit in only(Visited, patrol)
        if visit.write.tag_id == tag_id and visit.pass_index > pass_index
    )


def test_the_robot_never_enters_a_table_and_never_jumps(patrol: list[Event]) -> None:
    greenhouse = Mission(GreenhouseSimulator(), DEFAULT_SEED, DAY_SPEED).greenhouse
    positions = [event.position for event in only(RobotMoved, patrol)]
    assert positions[0] == DOCK
    assert any(dist(position, DOCK) < 1e-6 for position in positions[1:])
    assert len(positions) > 300
    assert all(greenhouse.is_free(position) for position in positions)
    assert max(dist(a, b) for a, b in pairwise(positions)) < 0.3


def test_the_day_goes_on_at_its_own_speed_and_wraps_at_midnight() -> None:
    played_visits = only(Visited, played(passes=2, day_speed=1_000.0))
    scans = [visit for visit in played_visits if not visit.write.kind]
    for scan in scans:
        assert 0.0 <= scan.time_of_day_s < 86_400.0
        assert scan.time_of_day_s == pytest.approx(
            (START_OF_DAY_S + 1_000.0 * scan.at_s) % 86_400.0
        )
    assert any(later.time_of_day_s < earlier.time_of_day_s for earlier, later in pairwise(scans))


def cell(grid: Grid, point: Point) -> int:
    """The value at a point, by the rule of nav_msgs/OccupancyGrid."""
    column = int((point[0] - grid.origin[0]) / grid.resolution_m)
    row = int((point[1] - grid.origin[1]) / grid.resolution_m)
    return int(np.frombuffer(grid.cells, dtype=np.int8)[row * grid.width + column])


def explored_from(*positions: Point, greenhouse: Greenhouse) -> Grid:
    exploration = Exploration(greenhouse)
    for position in positions:
        exploration.observe_from(position)
    return exploration.snapshot()


def everywhere(greenhouse: Greenhouse) -> list[Point]:
    return [
        (x, y)
        for x in np.arange(0.25, greenhouse.interior.x1, 0.5).tolist()
        for y in np.arange(0.25, greenhouse.interior.y1, 0.5).tolist()
        if greenhouse.is_free((x, y))
    ]


def test_a_complete_map_has_tables_and_walls_and_otherwise_free_floor() -> None:
    greenhouse = read_greenhouse(GreenhouseSimulator())
    grid = explored_from(*everywhere(greenhouse), greenhouse=greenhouse)
    assert known_in(grid) == len(grid.cells)
    for row in range(grid.height):
        for column in range(grid.width):
            x = grid.origin[0] + (column + 0.5) * RESOLUTION_M
            y = grid.origin[1] + (row + 0.5) * RESOLUTION_M
            is_floor = greenhouse.interior.contains((x, y)) and not any(
                table.contains((x, y)) for table in greenhouse.tables
            )
            assert cell(grid, (x, y)) == (FREE if is_floor else OCCUPIED), (x, y)


def test_nothing_is_known_beyond_the_view_radius() -> None:
    far = Greenhouse(Rect(0.0, 0.0, 8.0, 2.0), (), ())
    grid = explored_from((0.5, 1.0), greenhouse=far)
    cells = np.frombuffer(grid.cells, dtype=np.int8).reshape(grid.height, grid.width)
    for row, column in np.argwhere(cells != UNKNOWN):
        x, y = grid.origin[0] + (column + 0.5) * 0.05, grid.origin[1] + (row + 0.5) * 0.05
        assert dist((x, y), (0.5, 1.0)) <= VIEW_RADIUS_M
    assert cell(grid, (0.5 + VIEW_RADIUS_M - 0.1, 1.0)) == FREE
    assert cell(grid, (0.5 + VIEW_RADIUS_M + 0.1, 1.0)) == UNKNOWN


ROUNDS = range(30)


@pytest.fixture(scope="module")
def greenhouse() -> Greenhouse:
    return read_greenhouse(GreenhouseSimulator())


@pytest.fixture(scope="module")
def plants(greenhouse: Greenhouse) -> Plants:
    return Plants(greenhouse, 0)


def test_a_table_grows_one_species(greenhouse: Greenhouse, plants: Plants) -> None:
    by_table: dict[str, set[str]] = {}
    for tag in greenhouse.tags:
        by_table.setdefault(tag.table.name, set()).add(plants.species(tag.tag_id))
    assert len(by_table) == 10
    assert all(len(species) == 1 for species in by_table.values())
    grown = {name for species in by_table.values() for name in species}
    assert grown <= set(SPECIES)
    assert len(grown) > 1


def test_blooms_stand_inside_the_tags_own_table(greenhouse: Greenhouse, plants: Plants) -> None:
    for tag in greenhouse.tags:
        for pass_index in range(5):
            look = plants.inspect(tag.tag_id, pass_index, 0)
            assert look.blooms
            assert look.flower_count == len(look.blooms)
            for bloom in look.blooms:
                assert tag.table.contains((bloom.x, bloom.y))
                assert bloom.species == look.species == plants.species(tag.tag_id)
                assert 0.1 < bloom.height_m < 0.4
                assert bloom.z == TABLE_HEIGHT_M + bloom.height_m
                assert 0.0 <= bloom.confidence <= 1.0
            assert 0.0 <= look.confidence <= 1.0


def test_pests_appear_now_and_then_and_at_first(greenhouse: Greenhouse, plants: Plants) -> None:
    quiet = 0
    for tag in greenhouse.tags:
        history = [plants.bugs(tag.tag_id, pass_index) for pass_index in ROUNDS]
        quiet += history.count(0)
    assert sum(plants.bugs(tag.tag_id, 0) > 0 for tag in greenhouse.tags) == 1
    assert 0.9 < quiet / (29 * len(ROUNDS)) < 1.0


def test_a_pest_shows_in_the_inspection_and_on_some_blooms(
    greenhouse: Greenhouse, plants: Plants
) -> None:
    shown = 0
    for pass_index in ROUNDS:
        for tag in greenhouse.tags:
            look = plants.inspect(tag.tag_id, pass_index, 0)
            bugs = plants.bugs(tag.tag_id, pass_index)
            assert look.bug_count == bugs
            assert look.anomaly is (bugs > 0)
            on_blooms = sum(bloom.anomaly for bloom in look.blooms)
            assert (on_blooms > 0) is look.anomaly
            assert on_blooms <= min(3, bugs)
            shown += look.anomaly
    assert shown > 5
