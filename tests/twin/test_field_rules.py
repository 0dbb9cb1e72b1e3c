"""The rules of the fields are the parameters'."""

from __future__ import annotations

from lupin_twin.field_rules import field_rules
from lupin_twin.fields import FieldRules
from lupin_twin.parameters import TwinParameters


def test_each_rule_is_the_parameter_of_its_name() -> None:
    parameters = TwinParameters(
        idw_power=3.0,
        idw_falloff_radius_m=1.0,
        idw_max_distance_m=2.0,
        clip_to_explored=True,
        max_grid_cells=7,
    )
    assert field_rules(parameters) == FieldRules(3.0, 1.0, 2.0, True, 7)
