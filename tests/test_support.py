"""What the tests stand on, where it would only be slow if it were broken."""

import sys

from tests.support.domains import ros_env
from tests.support.template import PROGRAMS, Template


def test_the_programs_that_tests_start_are_forked_and_not_imported_anew(domain: int) -> None:
    template = Template(imported=())
    try:
        for program in PROGRAMS:
            assert template.can_be([sys.executable, "-m", program], ros_env(domain)), program
    finally:
        template.end()
