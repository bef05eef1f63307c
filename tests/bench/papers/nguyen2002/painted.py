"""Painted targets whose truth is known: place, share that is covered, and light."""

import numpy as np

from datasets import Sequence

ROWS, COLUMNS, WIDTH, HEIGHT = 120, 160, 30, 24


def _smooth(seed, rows, columns):
    """A picture of soft, coloured blobs."""
    generator = np.random.default_rng(seed)
    coarse = generator.uniform(40, 215, (rows // 6 + 2, columns // 6 + 2, 3))
    down = np.linspace(0, len(coarse) - 1.001, rows)
    across = np.linspace(0, coarse.shape[1] - 1.001, columns)
    i, j = down.astype(int), across.astype(int)
    u, v = (down - i)[:, None, None], (across - j)[None, :, None]
    upper = (1 - v) * coarse[i][:, j] + v * coarse[i][:, j + 1]
    lower = (1 - v) * coarse[i + 1][:, j] + v * coarse[i + 1][:, j + 1]
    return (1 - u) * upper + u * lower


def _disc():
    down, across = np.indices((HEIGHT, WIDTH)) + 0.5
    return ((down / HEIGHT - 0.5) ** 2 + (across / WIDTH - 0.5) ** 2) < 0.25


GROUND, TARGET = _smooth(0, ROWS, COLUMNS), _smooth(1, HEIGHT, WIDTH)
WHOLE, DISC = np.ones((HEIGHT, WIDTH), bool), _disc()
"""Shapes of targets in their boxes."""


def frame(x, y, *, covered=0.0, lamp=1.0, seed=0, shape=WHOLE):
    """The target at a place, with a purple thing over a share of it from the left, and noise."""
    image = GROUND.copy()
    image[y : y + HEIGHT, x : x + WIDTH][shape] = TARGET[shape]
    if covered:
        image[y - 4 : y + HEIGHT + 4, x - 20 : x + round(covered * WIDTH)] = 90, 30, 200
    noise = np.random.default_rng(seed).normal(0, 2, image.shape)
    return np.clip(np.round(lamp * image + noise), 0, 255).astype(np.uint8)


def sequence(n=50, *, covered=None, lamp=None, shape=WHOLE, attributes=None):
    """The target moves to the right and down; shares that are covered, and light, by frame."""
    covered, lamp = covered or [0.0] * n, lamp or [1.0] * n
    places = [(30 + t, 40 + t // 3) for t in range(n)]

    def mask(t):
        found = np.zeros((ROWS, COLUMNS), bool)
        x, y = places[t]
        found[y : y + HEIGHT, x : x + WIDTH] = shape
        return found

    return Sequence(
        "painted",
        [
            frame(x, y, covered=covered[t], lamp=lamp[t], seed=t, shape=shape)
            for t, (x, y) in enumerate(places)
        ],
        [[x, y, WIDTH, HEIGHT] for x, y in places],
        fingerprint="p",
        visibility=1 - np.array(covered),
        masks=mask,
        attributes=attributes,
    )


def occluded(n=60, begin=15, speed=0.1, frames=8):
    """Covered from a frame on, wholly for some frames, then free from one frame to the next."""
    sliding_in = [min(1.0, speed * (t + 1)) for t in range(int(1 / speed) + frames)]
    covered = [0.0] * begin + sliding_in
    return sequence(n, covered=covered + [0.0] * (n - len(covered)))
