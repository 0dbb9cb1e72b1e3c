"""A sensor's colour as numbers. Pure."""

from __future__ import annotations

import colorsys


def rgb(hue: float, saturation: float, lightness: float) -> tuple[int, int, int]:
    """A colour of degrees, percent, percent as 0 to 255 a channel (CSS Color 4, section 7)."""
    channels = colorsys.hls_to_rgb(hue / 360, lightness / 100, saturation / 100)
    red, green, blue = (round(channel * 255) for channel in channels)
    return red, green, blue
