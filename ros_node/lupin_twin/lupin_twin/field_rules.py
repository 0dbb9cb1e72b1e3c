"""From the parameters to the rules of the fields, for the node and for `web`. Pure."""

from __future__ import annotations

from lupin_twin.fields import FieldRules
from lupin_twin.parameters import TwinParameters


def field_rules(parameters: TwinParameters) -> FieldRules:
    """The parameters that say how fields are made."""
    return FieldRules(
        idw_power=parameters.idw_power,
        falloff_radius_m=parameters.idw_falloff_radius_m,
        max_distance_m=parameters.idw_max_distance_m,
        clip_to_explored=parameters.clip_to_explored,
        max_grid_cells=parameters.max_grid_cells,
    )
