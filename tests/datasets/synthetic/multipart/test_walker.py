"""Walkers: silhouette, size and visible side."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.datasets.synthetic.multipart.look import WalkerLook
from trackmark.datasets.synthetic.multipart.walker import GaitPose, Walker

LOOK = WalkerLook(shirt=(40, 50, 170), trousers=(120, 70, 40), bag=(60, 160, 60))
WALKER = Walker(LOOK, 1)
ONES = np.ones(5)

RIGHT, FRONT, LEFT, BACK = 0.0, np.pi / 2, np.pi, -np.pi / 2


def drawn(walker=WALKER, ground=128, x=160.0, y=280.0, height=240.0, gains=ONES, **pose):
    canvas = np.full((320, 320, 3), ground, np.uint8)
    chosen = GaitPose(**{"phase": 0.2, "stride": 1.0, "heading": RIGHT} | pose)
    walker.draw(canvas, x, y, height, chosen, gains)
    return canvas


def changed(**options):
    """Return the pixels that occlude the ground."""
    dark, light = drawn(ground=0, **options), drawn(ground=255, **options)
    return (light.astype(int) - dark).min(axis=2) < 250


@pytest.mark.parametrize("heading", [RIGHT, FRONT, BACK, 0.8])
@pytest.mark.parametrize("phase", [0.2, 0.7])
def test_silhouette_equals_the_drawing_without_motion(heading, phase):
    pose = {"phase": phase, "stride": 0.0, "heading": heading}
    dark, light = drawn(ground=0, **pose), drawn(ground=255, **pose)
    painted = 255 - (light.astype(int) - dark).mean(axis=2)
    left, top, coverage = WALKER.coverage(160.0, 280.0, 240.0, GaitPose(**pose))
    whole = np.zeros((320, 320))
    whole[top : top + coverage.shape[0], left : left + coverage.shape[1]] = coverage
    body = np.arange(320)[:, None] < 262  # above the shadow
    assert np.abs(painted - whole)[np.broadcast_to(body, whole.shape)].max() <= 12
    assert (painted >= whole - 12).all()


@pytest.mark.parametrize("heading", np.linspace(-np.pi, np.pi, 5))
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_head_and_feet_are_at_the_requested_rows(heading, phase):
    _, top, coverage = WALKER.coverage(160, 280, 240, GaitPose(phase, 1.0, heading))
    rows = top + np.flatnonzero((coverage > 127).any(axis=1))
    assert abs(rows[-1] + 1 - 280) <= 3
    assert -1 <= rows[0] - 40 <= 0.05 * 240  # a wide step lowers the head
    standing = WALKER.coverage(160, 280, 240, GaitPose(phase, 0.0, heading))
    assert abs(standing[1] + np.flatnonzero((standing[2] > 127).any(axis=1))[0] - 40) <= 2


def green(picture):
    return int(((picture[..., 1] > 90) & (picture[..., 2] < 90) & (picture[..., 0] < 90)).sum())


def test_walker_heading_changes_the_visible_side():
    assert green(drawn(heading=BACK)) > 1500
    assert green(drawn(heading=FRONT)) < 200  # only the straps
    assert 200 < green(drawn(heading=RIGHT)) < green(drawn(heading=BACK))
    opened = Walker(WalkerLook((220, 220, 220), (60, 55, 50), jacket=(60, 80, 60)), 2)
    white = [int((drawn(opened, heading=way).min(axis=2) > 150).sum()) for way in (FRONT, BACK)]
    assert white[0] > 800 > 50 > white[1]
    skin = [drawn(heading=way)[44:75].astype(int) for way in (FRONT, BACK)]
    faces = [((s[..., 2] - s[..., 0] > 40) & (s[..., 2] > 120)).sum() for s in skin]
    assert faces[0] > 10 * max(faces[1], 1)


@settings(max_examples=25, deadline=None)
@given(
    x=st.floats(-200, 300),
    y=st.floats(-100, 500),
    height=st.floats(12, 200),
    phase=st.floats(0, 3),
    stride=st.floats(0, 1),
    heading=st.floats(-7, 7),
    motion=st.floats(-20, 20),
)
def test_walker_draws_nothing_outside_the_canvas(x, y, height, phase, stride, heading, motion):
    room = np.full((160, 140, 3), 77, np.uint8)
    canvas = room[20:140, 20:120]
    WALKER.draw(canvas, x, y, height, GaitPose(phase, stride, heading), ONES, (motion, 0.0))
    room[20:140, 20:120] = 77
    assert (room == 77).all()
