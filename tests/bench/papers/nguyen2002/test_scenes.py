"""What is measured on scenes, and whether it is what the claims ask for."""

import numpy as np
import pandas as pd
import pytest

from bench.claims.kinds import BoundTest, PartsTest, RatioTest
from bench.claims.ledger import read_claims
from bench.claims.sides import limited
from bench.papers.nguyen2002 import occlusions, scenes, templates
from bench.papers.nguyen2002.follower import FEATURES
from datasets import Sequence
from tests.bench.papers.nguyen2002.painted import (
    COLUMNS,
    DISC,
    HEIGHT,
    ROWS,
    WIDTH,
    occluded,
    sequence,
)
from trackers.templates.matching import Pose

OWN = ("ng-9-failures", "ng-10")  # tables that are made of runs


def parts_on_tables():
    for claim in read_claims("nguyen2002").values():
        parts = claim.test.parts if isinstance(claim.test, PartsTest) else {"": claim.test}
        for test in parts.values():
            if test.table.startswith("ng-") and test.table not in OWN:
                yield claim.id, test


def test_what_claims_compare_is_what_is_measured():
    tables = {}
    for check in scenes.CHECKS:
        shape = {"shape": DISC} if check.measure is templates.corners else {}
        shown = occluded() if check.measure is occlusions.watched else sequence(40, **shape)
        tables |= check.measure(shown, quick=True)
    names = set()
    for name, test in parts_on_tables():
        names.add(name)
        table = tables[test.table]
        assert set(test.columns) <= {*table, "sequence", "scene"}, name
        if not isinstance(test, BoundTest | RatioTest):
            where = {key: values for key, values in test.where.items() if key != "features"}
            for side in test.sides:
                rows = limited(table, where | {column: [value] for column, value in side.items()})
                assert len(rows), (name, side)
    assert names == {"NG-9", *(f"NG-{n}" for n in range(11, 18)), "NG-19", "NG-21", "NG-22"}


def test_a_target_that_clutter_repeats_has_no_margin():
    shown = sequence(12)
    rows = scenes.clutter(shown, quick=True)["ng-9"]
    assert rows["features"].tolist() == list(FEATURES)
    assert (rows["margin"] > 1).all()
    np.testing.assert_allclose(rows["margin"], rows["in_clutter"] - rows["at_target"])
    images = [image.copy() for image in shown]
    for t, image in enumerate(images):
        x, y = 30 + t, 40 + t // 3
        image[90 : 90 + HEIGHT, 100 : 100 + WIDTH] = image[y : y + HEIGHT, x : x + WIDTH]
    twin = Sequence("t", images, shown.boxes, fingerprint="t", visibility=shown.visibility)
    repeated = scenes.clutter(twin, quick=True)["ng-9"]
    assert (repeated["margin"].abs() < 0.05).all()
    # A twin passes for the target as far as the target does, by all features.
    assert (repeated["false_alarms"] > 0.9).all()
    assert (rows["false_alarms"] < 0.7).all()
    by_features = rows.set_index("features")["false_alarms"]
    assert by_features["intensity"] > by_features["rgb"]


def test_clutter_is_searched_everywhere_but_at_the_target():
    places = scenes.clutter_places(Pose(60.0, 50.0, 1.0), (24, 30), ROWS, COLUMNS)
    reach = scenes.RANGE + scenes.STRAY
    apart = [(abs(place.x - 60), abs(place.y - 50)) for place in places]
    assert all(x - reach > 15 or y - reach > 12 for x, y in apart)
    assert all(place.x - reach >= 15 and place.x + reach <= COLUMNS - 15 for place in places)
    assert max(place.x for place in places) > 120
    assert np.diff(np.unique([place.x for place in places])).max() <= 2 * scenes.RANGE


def test_ratios_of_colours_outlast_shade_and_intensity_does_not():
    rows = scenes.shading(sequence(2), quick=False)["ng-21"].set_index(["cause", "features"])
    for cause in ("shade", "shading"):
        change = rows.loc[cause, "change"]
        assert change["invariants"] < 0.1 < change["rgb"]
        assert change["arctan"] < 0.1 < change["intensity"]
    lit = sequence(2)[0][40 : 40 + HEIGHT, 30 : 30 + WIDTH].sum(axis=2)
    # Half of the target lies in half of the light, and so does half of the edge on average.
    expected = 0.5 * lit[:, : WIDTH // 2].mean() / 2 / lit.std()
    assert rows.loc[("shade", "intensity"), "change"] == pytest.approx(expected, rel=0.1)


def test_noise_is_added_and_false_occlusions_are_counted():
    shown = sequence(30)
    noisy = scenes.Noisy(shown.frames, 4.0)
    assert (noisy[3] == noisy[3]).all()
    assert (noisy[3].astype(float) - shown[3]).std() == pytest.approx(4, abs=0.2)
    rows = scenes.sensor(shown, quick=True)["ng-22"]
    assert sorted(rows["noise"].unique()) == [1, 2, 4, 8]
    assert rows.groupby("trace").size().tolist() == [8, 8]
    assert (rows["false_occlusions"] == 0).all()
    assert (rows["mean_overlap"] > 0.8).all()


@pytest.mark.parametrize("flashes", [(12,), (8, 22)])
def test_flashes_are_false_occlusions_counted_one_by_one_and_made_up_for_in_the_end(flashes):
    """The second comes before the first is over: the tracker looks 35 frames ahead."""
    shown = sequence(30, lamp=[0.3 if t in flashes else 1.0 for t in range(30)])
    rows = scenes.sensor(shown, quick=True)["ng-22"].query("features == 'rgb' and noise == 1")
    by_trace = rows.set_index("trace")
    assert by_trace["false_occlusions"].tolist() == pytest.approx([100 * len(flashes) / 30] * 2)
    if len(flashes) == 1:
        assert by_trace.loc["revised", "mean_overlap"] > by_trace.loc["online", "mean_overlap"]


def test_a_part_is_much_longer_than_what_an_occlusion_may_hide():
    assert scenes.sensor(sequence(2 * 35), quick=False) == {}


def test_lines_are_laid_through_all_noises_of_features_and_trace():
    found = pd.DataFrame(
        {
            "features": one,
            "trace": trace,
            "noise": noise,
            "mean_overlap": 0.9 - slope * noise,
            "false_occlusions": 8.0 * (noise == 4),
        }
        for one, slope in (("rgb", 0.01), ("invariants", 0.02))
        for trace in ("revised", "online")
        for noise in (1.0, 2.0, 4.0, 8.0)
    )
    lines = scenes.lines(found).set_index(["features", "trace", "noise"]).sort_index()
    assert len(lines) == 2 * 2 * 2
    assert lines.loc[("rgb", "online", 1.0), "mean_overlap"] == pytest.approx(0.89)
    assert lines.loc[("invariants", "revised", 8.0), "mean_overlap"] == pytest.approx(0.74)
    # What is found between the least and the greatest noise counts.
    at_ends = np.polyval(np.polyfit([1, 2, 4, 8], [0, 0, 8, 0], 1), [1, 8])
    counted = lines.loc[("rgb", "revised"), "false_occlusions"]
    assert counted.tolist() == pytest.approx(at_ends.tolist())
    assert at_ends[0] > 1
