"""Parameters out of ROS: declared from the table in `parameters`; every complaint names one.

For the twin's node, and for whoever else reads some of the twin's parameters.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from typing import Any, Final

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidServiceNameException,
    InvalidTopicNameException,
)

from lupin_twin.parameters import ParameterError, TwinParameters, describe

ALL_NAMES: Final = tuple(spec.name for spec in fields(TwinParameters))


def declare(node: Any, names: Iterable[str] = ALL_NAMES) -> TwinParameters:
    """Declare these of the twin's parameters on a node and read them; the others keep defaults.

    Warns of each override that is no parameter at all: most likely a name with a typing error.

    Raises:
        ParameterError: a value of the wrong type or out of its range.

    """
    defaults = TwinParameters()
    values = {}
    for name in names:
        description, limits = describe(name)
        values[name] = node.declare_parameter(
            name,
            getattr(defaults, name),
            # dynamic_typing: `idw_power: 2` is an integer to YAML; the range check takes it.
            ParameterDescriptor(
                description=description,
                additional_constraints=limits,
                read_only=True,
                dynamic_typing=True,
            ),
        ).value
    for name in unknown_overrides(node):
        node.get_logger().warning(f"parameter {name} is unknown and has no effect")
    # What another node of the twin's reads from the same file has to be right here as well.
    given = {name: value for name, value in _overrides(node).items() if name in ALL_NAMES}
    TwinParameters(**given)
    return TwinParameters(**values)


def unknown_overrides(node: Any) -> list[str]:
    """Names that were set for a node (`-p`, a file) and that neither it nor the twin has."""
    return sorted(
        name for name in _overrides(node) if name not in ALL_NAMES and not node.has_parameter(name)
    )


def _overrides(node: Any) -> dict[str, Any]:
    # rclpy has no public way to see an override without declaring it.
    overrides = node._parameter_overrides  # noqa: SLF001
    return {name: parameter.value for name, parameter in overrides.items()}


@contextmanager
def naming(parameter: str, value: str) -> Iterator[None]:
    """Turn rclpy's complaint about a topic's name into one that names the parameter."""
    try:
        yield
    except (InvalidTopicNameException, InvalidServiceNameException) as error:
        reason = " ".join(str(error).split())
        raise ParameterError(f"parameter {parameter} is {value!r}: {reason}") from error


@contextmanager
def naming_own_parameters() -> Iterator[None]:
    """Turn rclpy's complaint about its own parameters, made with the node, into one of ours.

    They are `use_sim_time` and `start_type_description_service`.
    """
    try:
        yield
    except InvalidParameterTypeException as error:
        name = str(error).rpartition(": ")[2]
        raise ParameterError(f"parameter {name} is no bool: {error}") from error
