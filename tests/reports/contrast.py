"""Contrast of two colours as defined by WCAG 2."""

import numpy as np


def rgb(hexadecimal):
    """Return red, green and blue, from 0 to 255, of `#rrggbb`."""
    return tuple(bytes.fromhex(hexadecimal.lstrip("#")))


def linear(colour):
    """Convert red, green and blue from 0 to 255 to linear light in [0, 1]."""
    parts = np.asarray(colour) / 255
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def contrast(first, second):
    dark, light = sorted(linear(colour) @ [0.2126, 0.7152, 0.0722] for colour in (first, second))
    return (light + 0.05) / (dark + 0.05)
