"""Messages in JSON, compared with the output of rosbridge_suite."""

import json
import math
from array import array
from typing import Any, ClassVar

import numpy as np
import pytest

from lupin_bridge.viewers.rosbridge_protocol import json_of


class Stamp:
    sec, nanosec = 5, 6

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]:
        return {"sec": "int32", "nanosec": "uint32"}


class Everything:
    """A message with every kind of field, as rclpy gives it."""

    FIELDS: ClassVar[dict[str, tuple[str, Any]]] = {
        "stamp": ("builtin_interfaces/Time", Stamp()),
        "text": ("string", "é"),
        "flag": ("boolean", True),
        "level": ("octet", b"\x02"),
        "ratio": ("double", math.nan),
        "cells": ("sequence<int8>", array("b", [-1, 0, 100])),
        "image": ("sequence<uint8>", array("B", [1, 2, 255])),
        "key": ("uint8[2]", np.array([7, 8], np.uint8)),
        "points": ("sequence<float, 9>", array("f", [0.5, math.inf])),
        "matrix": ("double[2]", np.array([1.0, 2.0])),
        "names": ("sequence<string>", ["a", "b"]),
        "stamps": ("sequence<builtin_interfaces/Time>", [Stamp()]),
    }

    def __getattr__(self, name: str) -> Any:
        return self.FIELDS[name][1]

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {name: kind for name, (kind, _) in cls.FIELDS.items()}


def test_json_has_lists_base64_for_bytes_and_null_for_what_is_not_finite() -> None:
    assert json.loads(json_of(Everything())) == {
        "stamp": {"sec": 5, "nanosec": 6},
        "text": "é",
        "flag": True,
        "level": 2,
        "ratio": None,
        "cells": [-1, 0, 100],
        "image": "AQL/",
        "key": "Bwg=",
        "points": [0.5, None],
        "matrix": [1.0, 2.0],
        "names": ["a", "b"],
        "stamps": [{"sec": 5, "nanosec": 6}],
    }


@pytest.mark.parametrize("length", [0, 1, 65_536, 65_537])
def test_a_list_of_any_length_is_complete(monkeypatch: pytest.MonkeyPatch, length: int) -> None:
    cells = array("b", [number % 101 - 1 for number in range(length)])
    monkeypatch.setitem(Everything.FIELDS, "cells", ("sequence<int8>", cells))
    assert json.loads(json_of(Everything()))["cells"] == cells.tolist()


def test_a_text_that_is_not_unicode_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(Everything.FIELDS, "text", ("string", "\udcff"))
    with pytest.raises(ValueError, match="UTF-8"):
        json_of(Everything())
