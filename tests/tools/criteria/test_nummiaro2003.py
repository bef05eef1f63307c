"""Criteria of the nummiaro2003 scenes: changes of colour and of the angle of view."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.tools.criteria.scenes import blocks
from tools.criteria import nummiaro2003
from tools.criteria.nummiaro2003 import (
    mean_colour,
    recoloured_share,
    recolouring,
    turned_share,
    viewing_angle,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.scene import DrivingPath, DrivingPlan
from trackmark.datasets.synthetic.nummiaro2003.driving.view import PerspectiveView

BOX = (10, 10, 20, 20)
RED, BLACK, GREY = (0, 0, 255), (0, 0, 0), (119, 119, 119)


def of_colours(colours):
    """Return a scene with a block that has one colour per frame."""
    return blocks([(BOX, colour, 40) for colour in colours])


def test_mean_colour_is_cielab_of_red():
    # CIELAB of sRGB red under D65, from the definition of CIE 1976: 53.24, 80.09, 67.20.
    colour = mean_colour(of_colours([RED]), 0)
    assert colour == pytest.approx([53.24, 80.09, 67.20], abs=0.05)


def test_recoloured_share_counts_frames_beyond_the_difference():
    # ΔE of grey 119 and black is the lightness of this grey, 50.0.
    scene = of_colours([GREY, GREY, BLACK, BLACK, BLACK])
    assert recoloured_share(scene, difference=49.5, step=1) == pytest.approx(0.6)
    assert recoloured_share(scene, difference=50.5, step=1) == 0


def test_recolouring_compares_frames_at_the_given_distance():
    scene = of_colours([GREY, GREY, BLACK, BLACK])
    assert recolouring(scene, frames=2, percentile=0, step=1) == pytest.approx(50.0, abs=0.2)
    assert recolouring(scene, frames=1, percentile=100, step=1) == pytest.approx(50.0, abs=0.2)
    assert recolouring(scene, frames=1, percentile=50, step=1) == 0


def test_viewing_angle_is_between_heading_and_line_of_sight(monkeypatch):
    """The car ahead turns by 30 degrees, and is seen 20 degrees to the left at the end."""
    headings = np.radians([0.0, 30.0])
    seen = np.radians([0.0, -20.0])
    path = DrivingPath(10 * np.sin(seen), 10 * np.cos(seen), headings)
    view = PerspectiveView(500.0, (320.0, 240.0), (0.0, 1.4, 0.0), 0.0, 0.0)
    plan = DrivingPlan(None, [view] * 2, [(None, path)])
    monkeypatch.setattr(nummiaro2003, "renderer", lambda scene, kind: SimpleNamespace(plan=plan))
    assert viewing_angle(None) == pytest.approx(50.0)


def test_turned_share_measures_the_angle_from_the_first_frame(monkeypatch):
    angles = np.radians([90.0, 120.0, 149.0, 151.0, 29.0])
    directions = np.stack([np.cos(angles), np.zeros(5), np.sin(angles)], axis=1)
    worker = SimpleNamespace(directions=directions)
    monkeypatch.setattr(
        nummiaro2003, "renderer", lambda scene, kind: SimpleNamespace(worker=worker)
    )
    scene = SimpleNamespace(sequence=SimpleNamespace(first_frame=0))
    assert turned_share(scene, angle=60) == pytest.approx(0.4)
