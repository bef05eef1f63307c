"""Images of a two-coloured target, and functions that run a tracker on images."""

import numpy as np

from trackmark import trackers

RED, BLUE, GREEN = (20, 72, 200), (200, 56, 30), (60, 180, 40)


def two_coloured(left, top, size, shape, noise=0.0, seed=0):
    """Return an image of a target on green; its upper half is red, its lower half is blue."""
    image = np.full((*shape, 3), GREEN, float)
    middle, columns = top + size[1] // 2, slice(max(left, 0), max(left + size[0], 0))
    image[max(top, 0) : max(middle, 0), columns] = RED
    image[max(middle, 0) : max(top + size[1], 0), columns] = BLUE
    image += np.random.default_rng(seed).normal(0, noise, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


def track(name, images, box, seed=0, **parameters):
    """Return the estimates from the second image on."""
    tracker = trackers.create(name, seed, **parameters)
    tracker.init(images[0], np.asarray(box, float))
    return [tracker.update(image) for image in images[1:]]


def boxes_of(estimates):
    return np.array([estimate.box for estimate in estimates])


def centres_of(estimates):
    return np.array([estimate.box[:2] + estimate.box[2:] / 2 for estimate in estimates])


def box_of(mask):
    """Return the bounding box of a mask."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    x, y = columns[0], rows[0]
    return np.array([x, y, columns[-1] + 1 - x, rows[-1] + 1 - y], float)
