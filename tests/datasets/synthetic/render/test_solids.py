"""Ray-traced solids, compared with areas and positions in closed form."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.render.solids import (
    _END,
    _START,
    NOTHING,
    ParallelView,
    _distance,
    bowl,
    box,
    cast_rays,
    half_space,
    limb,
    pack_objects,
)

PITCH = 0.3
VIEW = ParallelView(PITCH, (0.6, 0.64, 0.48))
FINE = 4


def look(*things, shaded=False):
    """Render 40 x 40 pixels around the origin."""
    return cast_rays(things, VIEW, (-20.0, -20.0), (40, 40), FINE, shaded)


def area(owners, thing=0):
    return (owners == thing).sum() / FINE**2


def ball(place, radius):
    return limb(place, np.asarray(place) + (0, 1e-6, 0), (radius, radius))


def test_ball_is_rendered_as_a_disc():
    owners, places, _ = look([ball((1, 2, 3), 6.0)])
    assert area(owners) == pytest.approx(np.pi * 36, rel=0.01)
    surface = places[owners == 0]
    assert np.linalg.norm(surface - (1, 2, 3), axis=1) == pytest.approx(6, abs=0.03)
    rows, columns = np.nonzero(owners == 0)
    assert (columns.mean() + 0.5) / FINE - 20 == pytest.approx(1, abs=0.05)
    assert (rows.mean() + 0.5) / FINE - 20 == pytest.approx(float(VIEW.row(2, 3)), abs=0.05)


def test_limb_is_as_wide_as_its_end_balls():
    owners, _, _ = look([limb((-10, 0, 0), (10, 0, 0), (3, 3))])
    assert area(owners) == pytest.approx(20 * 6 + np.pi * 9, rel=0.01)


@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_box_shows_its_front_and_its_top(turn):
    half = np.array([6.0, 4.0, 3.0])
    owners, _, _ = look([box((0, 0, 0), half, 0.01, turn=turn)])
    front = 4 * (half[0] * np.cos(turn) + half[2] * np.sin(turn)) * half[1] * np.cos(PITCH)
    top = 4 * half[0] * half[2] * np.sin(PITCH)
    assert area(owners) == pytest.approx(front + top, rel=0.02)


@pytest.mark.parametrize("closed", [False, True])
def test_open_bowl_shows_its_inner_wall(closed):
    owners, places, _ = look([bowl((0, -5, 0), 10.0, (7.0, 7.0), 0.4, closed)])
    x, y, z = places[owners == 0].T
    far = (z < -3) & (np.abs(x) < 2)
    deepest = 5.2 if closed else 5.2 - (7 + 6.8) * np.tan(PITCH)
    assert y[far].min() == pytest.approx(deepest, abs=0.3)  # the rim is round
    assert (np.hypot(x, z)[far].min() < 4) == closed
    outline = 14.4 * 10 * np.cos(PITCH) + np.pi * 7.2**2 * np.sin(PITCH)
    assert area(owners) == pytest.approx(outline, rel=0.04)


def test_lit_side_is_brighter_and_ball_casts_a_shadow():
    ground = [half_space((0, 1, 0), -4)]
    owners, places, lights = look(ground, [ball((0, 3, 0), 4.0)], shaded=True)
    shaft = np.array(VIEW.light)
    towards = (places - (0, 3, 0)) @ shaft / 4
    on_ball, on_ground = owners == 1, owners == 0
    bright = lights[..., 0]
    assert bright[on_ball & (towards > 0.8)].min() > 1.5 * bright[on_ball & (towards < 0)].max()
    aside = np.linalg.norm(np.cross(places - (0, 3, 0), shaft), axis=2)
    dark, free = on_ground & (aside < 2), on_ground & (aside > 12)
    assert dark.any()
    assert bright[dark].max() < 0.75 * bright[free].min()


@pytest.mark.parametrize("with_planes", [True, False])
def test_cast_rays_agrees_with_full_distance_search(with_planes):
    random = np.random.default_rng(5)
    places = random.uniform(-18, 18, (12, 3))
    things = [
        [limb(place, place + random.uniform(-6, 6, 3), (2.5, 1.0), blend=1.5) for _ in range(3)]
        for place in places[:8]
    ]
    things += [
        [box(place, (4, 3, 2), 0.5, turn=0.4, lean=-0.2, folds=(0.8, 0.9))]
        for place in places[8:10]
    ]
    things += [[bowl(place, 5.0, (2.0, 3.0), 0.6)] for place in places[10:]]
    if with_planes:
        things += [[half_space((0, 1, 0), -15.0)], [half_space((0, 0, 1), -25.0)]]
    owners, seen, _ = look(*things)
    solids, balls = pack_objects(things)
    up, on = np.sin(PITCH), np.cos(PITCH)
    for row, column in random.integers(0, 40 * FINE, (400, 2)):
        x, below = (-20 + (k + 0.5) / FINE for k in (column, row))
        way, owner = 0.0, NOTHING
        y, z = _START * up - below * on, _START * on + below * up
        while way < _END:
            gap, owner = _distance(solids, balls, x, y, z)
            if gap < 0.02:
                break
            way += 0.9 * gap
            y, z = y - 0.9 * gap * up, z - 0.9 * gap * on
        if way < _END:
            assert owners[row, column] == owner
            assert seen[row, column] == pytest.approx([x, y, z], abs=1e-9)
        else:
            assert owners[row, column] == NOTHING
