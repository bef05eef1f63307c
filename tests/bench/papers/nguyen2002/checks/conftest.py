"""Painted targets whose truth is known: place, share that is covered, and light."""

import numpy as np
import pytest

from datasets import Sequence

ROWS, COLUMNS, WIDTH, HEIGHT = 120, 160, 30, 24


def smooth(seed, rows, columns):
    """A picture of soft, coloured blobs."""
    generator = np.random.default_rng(seed)
    coarse = generator.uniform(40, 215, (rows // 6 + 2, columns // 6 + 2, 3))
    down, across = (
        np.linspace(0, len(coarse) - 1.001, rows),
        np.linspace(0, coarse.shape[1] - 1.001, columns),
    )
    i, j = down.astype(int), across.astype(int)
    u, v = (down - i)[:, None, None], (across - j)[None, :, None]
    upper = (1 - v) * coarse[i][:, j] + v * coarse[i][:, j + 1]
    lower = (1 - v) * coarse[i + 1][:, j] + v * coarse[i + 1][:, j + 1]
    return (1 - u) * upper + u * lower


GROUND, TARGET = smooth(0, ROWS, COLUMNS), smooth(1, HEIGHT, WIDTH)


def shown(x, y, *, covered=0.0, lamp=1.0, seed=0, round_target=False):
    """The target at a place, with a grey thing over a share of it from the left, and noise."""
    image = GROUND.copy()
    there = image[y : y + HEIGHT, x : x + WIDTH]
    there[round_mask() if round_target else slice(None)] = TARGET[
        round_mask() if round_target else slice(None)
    ]
    edge = round(covered * WIDTH)
    image[y - 4 : y + HEIGHT + 4, x - 20 : x + edge] = (
        (90, 30, 200) if covered else image[y - 4 : y + HEIGHT + 4, x - 20 : x + edge]
    )
    noise = np.random.default_rng(seed).normal(0, 2, image.shape)
    return np.clip(np.round(lamp * image + noise), 0, 255).astype(np.uint8)


def round_mask():
    down, across = np.indices((HEIGHT, WIDTH)) + 0.5
    return ((down / HEIGHT - 0.5) ** 2 + (across / WIDTH - 0.5) ** 2) < 0.25


def moving(n=50, *, covered=None, lamp=None, round_target=False, attributes=None):
    """The target moves to the right and down; shares that are covered, and light, by frame."""
    covered = covered or [0.0] * n
    lamp = lamp or [1.0] * n
    xs, ys = [30 + t for t in range(n)], [40 + t // 3 for t in range(n)]
    images = [
        shown(x, y, covered=share, lamp=light, seed=t, round_target=round_target)
        for t, (x, y, share, light) in enumerate(zip(xs, ys, covered, lamp, strict=True))
    ]

    def mask(t):
        found = np.zeros((ROWS, COLUMNS), bool)
        found[ys[t] : ys[t] + HEIGHT, xs[t] : xs[t] + WIDTH] = (
            round_mask() if round_target else True
        )
        return found

    return Sequence(
        "painted",
        images,
        [[x, y, WIDTH, HEIGHT] for x, y in zip(xs, ys, strict=True)],
        fingerprint="p",
        visibility=1 - np.array(covered),
        masks=mask,
        attributes=attributes,
    )


def hidden_for_a_while(n=60, begin=15, speed=0.1, frames=8):
    """Covered from a frame on, wholly for some frames, then free from one frame to the next."""
    sliding_in = [min(1.0, speed * (t + 1)) for t in range(int(1 / speed) + frames)]
    covered = [0.0] * begin + sliding_in
    return moving(n, covered=covered + [0.0] * (n - len(covered)))


@pytest.fixture(scope="session")
def frame():
    """Makes one frame; see `shown`."""
    return shown


@pytest.fixture(scope="session")
def sequence():
    """Makes a sequence; see `moving`."""
    return moving


@pytest.fixture(scope="session")
def occluded():
    """Makes one with a complete occlusion; see `hidden_for_a_while`."""
    return hidden_for_a_while


@pytest.fixture(scope="session")
def disc():
    """Makes the mask of a round target in its box."""
    return round_mask
