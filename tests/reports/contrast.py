"""How well a colour is seen on another, as WCAG 2 defines it."""

import numpy as np


def linear(colour):
    """Light of red, green and blue, in 0..255, as shares of the most."""
    parts = np.asarray(colour) / 255
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def contrast(one, other):
    dark, light = sorted(linear(colour) @ [0.2126, 0.7152, 0.0722] for colour in (one, other))
    return (light + 0.05) / (dark + 0.05)
