"""numpy's products take one core: to be said before numpy is first imported.

OpenBLAS starts as many threads as there are cores, and lets each wait for all others with every
product. Beside a robot's other programs they wait for a core: a product takes ten times the time,
and meanwhile the cores that frames and observations need are busy waiting.
"""

from __future__ import annotations

import os
from typing import Final

_VARIABLE: Final = "OPENBLAS_NUM_THREADS"


def use_one_core() -> None:
    """Have OpenBLAS start no threads, in this process and its children, unless somebody said so."""
    os.environ.setdefault(_VARIABLE, "1")
