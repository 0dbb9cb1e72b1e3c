"""The wire format: names, types and order are shared with the robot's own packages, for good."""

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "ros_node" / "lupin_msgs"

# Each interface, and below it its fields and constants.
TABLE = Path(__file__).with_name("wire_format.txt").read_text(encoding="utf-8")
WIRE_FORMAT = {
    name: [line.strip() for line in fields]
    for name, *fields in map(str.splitlines, TABLE.split("\n\n")[1:])
}
_KINDS = (".msg", ".srv", ".action")


def lines_of(name: str) -> list[str]:
    return (PACKAGE / name).read_text(encoding="utf-8").splitlines()


def test_exactly_these_interfaces_exist() -> None:
    """The package's own tests check that all of them are built."""
    files = {p.relative_to(PACKAGE).as_posix() for p in PACKAGE.glob("*/*") if p.suffix in _KINDS}
    assert files == set(WIRE_FORMAT)


@pytest.mark.parametrize("name", WIRE_FORMAT)
def test_names_types_order_and_constants_are_those_of_the_contract(name: str) -> None:
    declared = [" ".join(line.partition("#")[0].split()) for line in lines_of(name)]
    assert [line for line in declared if line] == WIRE_FORMAT[name]


@pytest.mark.parametrize("name", WIRE_FORMAT)
def test_every_field_and_every_interface_has_a_comment(name: str) -> None:
    lines = lines_of(name)
    assert lines[0].startswith("# ")
    bare = [
        line
        for before, line in zip(["", *lines], lines, strict=False)
        if line
        and "=" not in line.partition("#")[0]
        and line != "---"
        and "#" not in line
        and not before.startswith("#")
    ]
    assert bare == []
