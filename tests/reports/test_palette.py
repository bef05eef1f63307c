"""Contrast and distinguishability of colours."""

from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest

from tests.reports.contrast import contrast, linear, rgb
from trackmark.bench.pages import page
from trackmark.reports.figures import line_style
from trackmark.reports.overlay import BACKGROUND
from trackmark.reports.palette import DARK, LIGHT, colour

GROUNDS = {"light": ("#f6f7f9", "#ffffff"), "dark": ("#101316", "#181c21")}  # pages and cards
SHADES = {"light": LIGHT, "dark": DARK}

# Machado, Oliveira and Fernandes (2009), of the severest kind; rows give red, green, blue.
SEEN = {
    "normal": np.eye(3),
    "no red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
               [-0.003882, -0.048116, 1.051998]],
    "no green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                 [-0.01182, 0.04294, 0.968881]],
    "no blue": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                [0.004733, 0.691367, 0.3039]],
}  # fmt: skip


def lab(values):
    """Convert linear sRGB to CIE L*a*b* under D65."""
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    x, y, z = np.cbrt(np.clip(to_xyz @ values, 1e-4, None) / [0.9505, 1.0, 1.089])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("ground", GROUNDS)
def test_line_colours_contrast_with_backgrounds(ground):
    for shade, behind in product(SHADES[ground], GROUNDS[ground]):
        assert contrast(rgb(shade), rgb(behind)) >= 3, (shade, behind)


def test_backgrounds_are_those_of_pages():
    css = (Path(page.__file__).parent / "templates" / "page.css").read_text()
    light, dark = css.split("prefers-color-scheme: dark")
    for theme, (ground, card) in zip((light, dark), GROUNDS.values(), strict=False):
        assert f"--page: {ground}; --paper: {card.replace('#ffffff', '#fff')};" in theme


@pytest.mark.parametrize(("sight", "count"), [("normal", 7), *((kind, 4) for kind in SEEN)])
def test_colours_are_distinguishable(sight, count):
    seen = [lab(np.clip(SEEN[sight] @ linear(rgb(shade)), 0, 1)) for shade in LIGHT[:count]]
    assert min(np.linalg.norm(first - second) for first, second in combinations(seen, 2)) > 19


def test_lines_differ_in_more_than_colour():
    styles = [line_style(position) for position in range(len(LIGHT) + 4)]
    for part in ("linestyle", "marker"):
        assert len({style[part] for style in styles[:4]}) == 4
    assert len({(style["color"], style["marker"]) for style in styles}) == len(styles)
    assert styles[2]["color"] == colour(2)


def test_colours_contrast_with_film_strip_background():
    for shade in LIGHT:
        assert contrast(rgb(shade), [BACKGROUND] * 3) >= 3
