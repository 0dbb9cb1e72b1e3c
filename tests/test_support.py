"""Test support whose failure would only show as slowness."""

import sys

from tests.support.domains import ros_env
from tests.support.template import PROGRAMS, Template


def test_the_programs_of_the_tests_are_forked_and_not_imported_anew(domain: int) -> None:
    template = Template(imported=())
    try:
        for program in PROGRAMS:
            assert template.can_be([sys.executable, "-m", program], ros_env(domain)), program
    finally:
        template.end()
