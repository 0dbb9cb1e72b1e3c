"""What `pytest --quick` leaves out: files that need ROS, a browser, or processes of the product.

Nobody keeps a list: a file is skipped as it is collected, once it imports something of that.
"""

import importlib.abc
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType

import pytest

from tests.support.structure import ROS

# A browser's driver; what starts processes of the product, which import ROS, or other programs.
OUTSIDE = ROS | {"playwright", "tests.support.processes", "tests.support.programs"}


class _NothingFromOutside(importlib.abc.MetaPathFinder):
    def find_spec(
        self, name: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name in OUTSIDE or name.partition(".")[0] in OUTSIDE:
            pytest.skip(f"{name} is not for the quick tests", allow_module_level=True)
        return None


def let_nothing_in() -> None:
    """From now on, who imports anything of that is skipped."""
    sys.meta_path.insert(0, _NothingFromOutside())
