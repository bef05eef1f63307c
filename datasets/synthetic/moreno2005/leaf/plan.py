"""Motion of a leaf in the wind: sways, gusts and jerks that nothing announces."""

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.moreno2005.leaf.blade import Shape
from trackmark.datasets.synthetic.render.path import quantised

Array = NDArray[np.float64]

FRAMES = 100
SIZE = 320, 240
JUMP = 1  # first frame in the other light; a gust moves the leaf in the same frame
FASTEST = 15.0  # speed in the strongest of the other gusts [pixels/frame]
FIRST_GUST = 1.1, 1.3  # strength of the gust in the frame of the jump
CALM = 6  # frames from the jump to the next gust
# Between which corners the middle of the leaf stays [pixels].
LOW, HIGH = np.array([62.0, 58.0]), np.array([258.0, 182.0])


def drawn_shapes(random: np.random.Generator) -> tuple[Shape, ...]:
    """The leaf in every frame, drawn at random."""
    gusts = _gusts(random)
    places = _places(random, gusts)
    angle = random.uniform(-np.pi, np.pi) + _shaken(random, gusts, 0.03, 0.26)
    yaw, pitch = (0.75 * np.tanh(_shaken(random, gusts, 0.045, 0.35)) for _ in range(2))
    bend = random.uniform(0.1, 0.5) + 0.6 * np.tanh(_shaken(random, gusts, 0.05, 0.3))
    fold = random.uniform(0.2, 0.35) + 0.15 * np.tanh(_shaken(random, gusts, 0.05, 0.4))
    return tuple(
        Shape(place, *values)
        for place, *values in zip(
            places, *(part.tolist() for part in (angle, yaw, pitch, bend, fold)), strict=True
        )
    )


def drawn_sway(random: np.random.Generator) -> Array:
    """How far the nearer foliage has been moved in every frame [pixels], shape (FRAMES, 2)."""
    gusts = _gusts(random)
    sway = [2.5 * np.tanh(_shaken(random, gusts, 0.10, 0.35)) for _ in range(2)]
    return quantised(np.stack(sway, axis=1))


def _gusts(random: np.random.Generator) -> Array:
    """Strength of a gust that begins in each frame, up to 1.3; most frames have none."""
    gusts = np.zeros(FRAMES)
    gusts[JUMP] = random.uniform(*FIRST_GUST)
    frame = JUMP + CALM + int(random.integers(6))
    while frame < FRAMES:
        gusts[frame] = random.uniform(0.45, 1.0)
        frame += int(random.integers(6, 15))
    return gusts


def _places(random: np.random.Generator, gusts: Array) -> Array:
    """Middle of the leaf, shape (FRAMES, 2): pushed, held back, pulled to where it hangs."""
    home = np.array([160.0, 120.0]) + random.uniform(-1, 1, 2) * [35, 20]
    place, speed = home + random.uniform(-8, 8, 2), random.normal(0, 0.8, 2)
    places = []
    for gust in gusts.tolist():
        direction = random.normal(size=2) + 0.012 * (home - place)
        push = direction / np.sqrt((direction * direction).sum())
        speed = 0.74 * speed + 0.03 * (home - place) + random.normal(0, 0.7, 2)
        speed = speed + gust * FASTEST * push
        speed *= min(1.0, FASTEST * max(1.0, gust) / float(np.sqrt((speed * speed).sum())))
        ahead = place + speed
        speed = np.where((ahead < LOW) | (ahead > HIGH), -0.5 * speed, speed)
        place = place + speed
        places.append(place)
    return quantised(np.array(places))


def _shaken(random: np.random.Generator, gusts: Array, restless: float, kick: float) -> Array:
    """Swings about 0 of something that is pushed a little always and hard by gusts."""
    value, speed, values = 0.0, 0.0, []
    for gust in gusts.tolist():
        speed = 0.8 * speed - 0.06 * value + random.normal(0, restless)
        speed += gust * kick * random.choice([-1, 1]) * random.uniform(0.4, 1.0)
        value += speed
        values.append(value)
    return np.array(values)
