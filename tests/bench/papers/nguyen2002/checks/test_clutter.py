"""How far a painted target stands out from clutter."""

import numpy as np

from bench.papers.nguyen2002.checks import clutter
from bench.papers.nguyen2002.checks.follower import FEATURES
from datasets import Sequence
from trackers.templates.matching import Pose

ROWS, COLUMNS, WIDTH, HEIGHT = 120, 160, 30, 24  # of the image, and of the painted target


def test_a_target_that_clutter_repeats_has_no_margin(sequence):
    shown = sequence(12)
    rows = clutter.measure(shown, quick=True)["ng-9"]
    assert rows["features"].tolist() == list(FEATURES)
    assert (rows["margin"] > 1).all()
    np.testing.assert_allclose(rows["margin"], rows["in_clutter"] - rows["at_target"])
    images = [image.copy() for image in shown]
    for t, image in enumerate(images):
        x, y = 30 + t, 40 + t // 3
        image[90 : 90 + HEIGHT, 100 : 100 + WIDTH] = image[y : y + HEIGHT, x : x + WIDTH]
    twin = Sequence("t", images, shown.boxes, fingerprint="t", visibility=shown.visibility)
    repeated = clutter.measure(twin, quick=True)["ng-9"]
    assert (repeated["margin"].abs() < 0.05).all()
    # A twin passes for the target as far as the target does, by all features.
    assert (repeated["false_alarms"] > 0.9).all()
    assert (rows["false_alarms"] < 0.7).all()
    by_features = rows.set_index("features")["false_alarms"]
    assert by_features["intensity"] > by_features["rgb"]


def test_clutter_is_searched_everywhere_but_at_the_target():
    pose, shape = Pose(60.0, 50.0, 1.0), (24, 30)
    places = clutter.clutter_places(pose, shape, ROWS, COLUMNS)
    reach = clutter.RANGE + clutter.STRAY
    apart = [(abs(place.x - 60), abs(place.y - 50)) for place in places]
    assert all(x - reach > 15 or y - reach > 12 for x, y in apart)
    assert all(place.x - reach >= 15 and place.x + reach <= COLUMNS - 15 for place in places)
    assert max(place.x for place in places) > 120
    columns = np.unique([place.x for place in places])
    assert np.diff(columns).max() <= 2 * clutter.RANGE
