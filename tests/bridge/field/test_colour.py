"""Colours: CSS and the bridge's pictures agree."""

import pytest

from lupin_bridge import field as colour


@pytest.mark.parametrize(
    ("hue", "saturation", "lightness", "rgb"),
    [  # worked examples of CSS Color 4, section 7
        (0, 100, 50, (255, 0, 0)),
        (120, 100, 25, (0, 128, 0)),
        (240, 100, 50, (0, 0, 255)),
        (60, 100, 50, (255, 255, 0)),
        (30, 50, 50, (191, 128, 64)),
        (200, 0, 40, (102, 102, 102)),
    ],
)
def test_a_colour_is_the_one_that_a_browser_shows(
    hue: float, saturation: float, lightness: float, rgb: tuple[int, int, int]
) -> None:
    assert colour.rgb(hue, saturation, lightness) == rgb
