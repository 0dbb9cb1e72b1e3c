"""`python -m lupin_patrol`: the same as the command `patrol_node`."""

import sys

from lupin_patrol.cli import main

sys.exit(main())
