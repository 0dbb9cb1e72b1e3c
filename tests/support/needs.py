"""What `pytest --quick` leaves out: files that need ROS, a browser, or processes of the product.

There is no list: a file is skipped during collection when it imports one of these.
"""

import importlib.abc
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType

import pytest

from tests.support.structure import ROS

# A browser's driver; modules that start processes of the product, which import ROS, or programs.
OUTSIDE = ROS | {"playwright", "tests.support.processes", "tests.support.programs"}


class _NothingFromOutside(importlib.abc.MetaPathFinder):
    def find_spec(
        self, name: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name in OUTSIDE or name.partition(".")[0] in OUTSIDE:
            pytest.skip(f"{name} is not for the quick tests", allow_module_level=True)
        return None


def let_nothing_in() -> None:
    """From now on, a test file that imports any of that is skipped."""
    sys.meta_path.insert(0, _NothingFromOutside())
