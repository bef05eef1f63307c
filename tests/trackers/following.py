"""Functions that run a tracker on images of a test."""

import numpy as np

from trackmark import trackers


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
