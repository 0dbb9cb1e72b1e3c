"""A node's ROS parameters, declared from the table in `core.parameters`; errors name the parameter.

For the twin's node, and for other nodes that read some of the twin's parameters.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from typing import Any, Final

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, NameValidationException
from rclpy.node import Node
from rclpy.parameter import Parameter

from lupin_twin.core.parameters import ParameterError, TwinParameters, changed, describe

ALL_NAMES: Final = tuple(spec.name for spec in fields(TwinParameters))


def declare(node: Any, names: Iterable[str] = ALL_NAMES) -> TwinParameters:
    """Declare some of the twin's parameters on a node and read them; the others keep defaults.

    Warns of each override that is not a parameter: most likely a misspelt name.

    Raises:
        ParameterError: a value has the wrong type, or is out of its range.

    """
    defaults, given = TwinParameters(), _overrides(node)
    # Checked before ROS does, because its message about a range differs. Values for other nodes in
    # the same file have to be valid here as well.
    TwinParameters(**{name: given[name] for name in ALL_NAMES if name in given})
    values = {}
    for name in names:
        default = getattr(defaults, name)
        values[name] = node.declare_parameter(
            name, _for_ros(default), _descriptor(name, default)
        ).value
    for name in unknown_overrides(node):
        node.get_logger().warning(f"parameter {name} is unknown and has no effect")
    return TwinParameters(**values)


def _for_ros(value: Any) -> Any:
    """The value for ROS, where an empty list has no type: one empty name stands for it."""
    return [*value] or [""] if isinstance(value, tuple) else value


def _descriptor(name: str, default: object) -> ParameterDescriptor:
    described = describe(name)
    descriptor = ParameterDescriptor(
        description=described.description,
        additional_constraints=described.fixed and f"read only: {described.fixed}",
        read_only=bool(described.fixed),
        # `idw_power: 2` is an integer in YAML; our own check accepts it.
        dynamic_typing=True,
    )
    if described.low is not None:
        if isinstance(default, int):
            descriptor.integer_range = [
                IntegerRange(from_value=int(described.low), to_value=int(described.high))
            ]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(described.low), to_value=float(described.high))
            ]
    return descriptor


class AdjustableNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """A node that has parameters which may be changed while it runs.

    `ros2 param set` calls the methods below. They check before rclpy does, which refuses values
    that are read only or out of range without naming the reason or the limit.
    """

    parameters = TwinParameters()

    def adjust(self, now: TwinParameters) -> None:
        """Apply changed parameters; called after each change of declared ones."""

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set the parameters one after the other."""
        return [self.set_parameters_atomically([one]) for one in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set all of the parameters or, with the reason, none."""
        wanted = {one.name: one.value for one in parameter_list if one.name in ALL_NAMES}
        try:
            new = changed(self.parameters, wanted)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        result = super().set_parameters_atomically(parameter_list)
        if result.successful and new != self.parameters:
            self.parameters = new
            self.adjust(new)
        return result


def unknown_overrides(node: Any) -> list[str]:
    """Names that were set for a node (`-p`, a file), but that neither it nor a twin has."""
    return sorted(
        name for name in _overrides(node) if name not in ALL_NAMES and not node.has_parameter(name)
    )


def _overrides(node: Any) -> dict[str, Any]:
    # rclpy has no public way to see an override without declaring it.
    overrides = node._parameter_overrides  # noqa: SLF001
    return {name: parameter.value for name, parameter in overrides.items()}


@contextmanager
def naming(parameter: str, value: str) -> Iterator[None]:
    """Turn rclpy's error about a topic's name into one that names the parameter."""
    try:
        yield
    except (NameValidationException, ValueError) as error:  # the latter for `{unknown}`
        reason = " ".join(str(error).split())
        raise ParameterError(f"parameter {parameter} is {value!r}: {reason}") from error


@contextmanager
def naming_own_parameters() -> Iterator[None]:
    """Turn rclpy's error about its own parameters into one of ours.

    They are made with the node: `use_sim_time` and `start_type_description_service`.
    """
    try:
        yield
    except InvalidParameterTypeException as error:
        name = str(error).rpartition(": ")[2]
        raise ParameterError(f"parameter {name} is not a bool: {error}") from error
