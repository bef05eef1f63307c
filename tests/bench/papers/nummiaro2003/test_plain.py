"""The plain filter against the tracker."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.nummiaro2003.plain import PlainFilter
from trackmark.bench.papers.nummiaro2003.timing import PLAIN
from trackmark.bench.papers.paper import read_paper

NAME = "plain/target"
PAPER = read_paper("nummiaro2003")


@pytest.fixture(scope="module")
def images():
    return list(datasets.load(NAME)[:25])


def assert_equal_estimates(images, box, setting="as-written", **options):
    """Compare box, threshold and count of samples; return the number of model updates."""
    text = PAPER.spec("no re-initialisation", setting)
    text += "".join(f":{key}={value}" for key, value in options.items())
    chosen = parse_tracker(text)
    tracker = chosen.make(np.random.SeedSequence(5))
    values = {name: chosen.parameters[name] for name in PLAIN}
    plain = PlainFilter(np.random.SeedSequence(5), **values)
    for method in (tracker, plain):
        method.init(images[0], box)
    updates = 0.0
    for image in images[1:]:
        threshold = plain.threshold
        plain.update(image)
        estimate = tracker.update(image)
        centre, half_axes = plain.mean[:2], plain.mean[4:6]
        plain_box = np.concatenate([centre - half_axes, 2 * half_axes])
        np.testing.assert_allclose(estimate.box, plain_box, atol=1e-6)
        assert estimate.details["appearance_threshold"] == pytest.approx(threshold, abs=1e-9)
        assert estimate.details["positive_appearances"] == plain.positive
        updates += estimate.details["updated"]
    return updates


@pytest.mark.parametrize("setting", SETTINGS)
def test_estimates_equal_those_of_the_tracker(images, setting):
    assert assert_equal_estimates(images, datasets.load(NAME).boxes[0], setting) > 0


@pytest.mark.parametrize(
    ("options", "updated"),
    [
        ({"particles": 30, "bins": 5}, True),
        ({"sigma": 0.05, "update_threshold": 0.2}, True),
        ({"update_threshold": 1.25}, False),
        ({"sigma": 0.3, "particles": 1, "update_threshold": 0.49}, True),
    ],
)
def test_estimates_equal_with_other_options(images, options, updated):
    updates = assert_equal_estimates(images, datasets.load(NAME).boxes[0], **options)
    assert (updates > 0) == updated


def test_estimates_equal_for_ellipse_partly_outside(images):
    box = np.array([images[0].shape[1] - 25.0, -12.5, 40.3, 60.7])
    assert_equal_estimates(images[:12], box)
