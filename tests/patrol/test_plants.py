"""Plants, pests and the result of an inspection."""

import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.greenhouse import TABLE_HEIGHT_M, Greenhouse, read_greenhouse
from lupin_patrol.perception import SPECIES, Plants

PASSES = range(30)


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
                assert tag.table.rect.contains((bloom.x, bloom.y))
                assert bloom.species == look.species == plants.species(tag.tag_id)
                assert 0.1 < bloom.height_m < 0.4
                assert bloom.z == TABLE_HEIGHT_M + bloom.height_m
                assert 0.0 <= bloom.confidence <= 1.0
            assert 0.0 <= look.confidence <= 1.0


def test_pests_appear_now_and_then_and_at_first(greenhouse: Greenhouse, plants: Plants) -> None:
    quiet = 0
    for tag in greenhouse.tags:
        history = [plants.bugs(tag.tag_id, pass_index) for pass_index in PASSES]
        quiet += history.count(0)
    assert sum(plants.bugs(tag.tag_id, 0) > 0 for tag in greenhouse.tags) == 1
    assert 0.9 < quiet / (29 * len(PASSES)) < 1.0


def test_a_pest_shows_in_the_inspection_and_on_some_blooms(
    greenhouse: Greenhouse, plants: Plants
) -> None:
    shown = 0
    for pass_index in PASSES:
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
