"""What is made up on a painted target shows what the paper says of the template."""

import numpy as np
import pytest

from bench.papers.nguyen2002.checks import (
    adapting,
    changed,
    contamination,
    corners,
    norms,
    shading,
    sliding,
)
from bench.papers.nguyen2002.checks.follower import FEATURES, Follower
from bench.papers.nguyen2002.checks.made_up import Patch
from datasets import Sequence

WIDTH, HEIGHT = 30, 24  # of the painted target


def test_a_gate_keeps_what_hides_the_target_out_of_the_template(sequence):
    tables = contamination.measure(sequence(31), quick=True)
    short, longer = (table.set_index("gate") for table in tables.values())
    assert short.loc["on", "template_error"] < short.loc["off", "template_error"]
    assert short.loc["on", "covered_error"] < 0.1 * short.loc["off", "covered_error"]
    # After n_omax frames what hides the target is taken for the target.
    assert longer.loc["on", "covered_error"] > 0.5 * longer.loc["off", "covered_error"]


def test_corners_of_a_round_target_are_outliers(sequence, disc):
    rows = corners.measure(sequence(30, round_target=True), quick=True)["ng-12"].set_index("part")
    assert rows["background"].tolist() == [pytest.approx(1 - disc().mean())] * 2
    assert rows.loc["corners", "flagged"] > rows.loc["three times inside", "flagged"]
    shown = sequence(15, round_target=True)
    outer, inner = corners._flagged(Follower(shown[0], shown.boxes[0]), shown)
    assert outer > 3 * inner > 0
    shown = corners.measure(shown, quick=True)["ng-12"]
    assert shown["flagged"].tolist() == pytest.approx([outer, 3 * inner])
    assert corners.measure(sequence(30), quick=True) == {}


def test_pixels_that_changed_for_good_stay_outliers_unless_they_are_taken_anew(sequence):
    rows = changed.measure(sequence(35), quick=True)["ng-13"].set_index("rebootstrap")
    assert rows.loc["off", "flagged"] > 0.8
    assert rows.loc["on", "flagged"] < 0.2
    assert (rows["flagged_others"] < 0.2).all()


def test_a_template_of_adaptive_noise_follows_the_light(sequence):
    n = adapting.BEFORE + adapting.DURING
    rows = adapting.measure(sequence(n), quick=True)["ng-14"]
    assert set(rows["change"]) == {"dimming", "turning"}
    rgb = rows[(rows["features"] == "rgb") & (rows["change"] == "dimming")]
    by = rgb.set_index(["adaptive", "phase"])
    assert (rows.loc[rows["adaptive"] == "off", "state_noise"] == 0).all()
    errors = by["template_error"]
    assert errors["off", "before"] < 0.5 * errors["off", "change"]
    assert by.loc[("on", "change"), "gain"] > by.loc[("off", "change"), "gain"]
    assert by.loc[("on", "change"), "template_error"] < by.loc[("off", "change"), "template_error"]


@pytest.mark.parametrize("features", FEATURES)
def test_the_gain_is_what_inliers_move_by_which_is_half_of_the_first_residuals(sequence, features):
    shown = sequence(12)
    follower = Follower(shown[0], shown.boxes[0], features)
    gains = []
    for t in range(1, 12):
        view, before = follower.look(shown[t]), follower.appearance.template.copy()
        follower.take(view)
        gains.append(adapting.gain_of(view.seen, before, follower.appearance.template))
    assert gains[0] == pytest.approx(0.5)  # equation 15
    assert 0 < gains[-1] < 0.4  # noise is averaged out


def test_a_lamp_that_is_switched_is_a_change_where_the_target_is_clear(sequence):
    n = 2 * (adapting.BEFORE + adapting.DURING)
    off = np.zeros(n, bool)
    off[adapting.BEFORE : n - adapting.DURING] = True
    lamp = [0.6 if flag else 1.0 for flag in off]
    shown = sequence(n, lamp=lamp, attributes={"lamp off": off})
    rows = adapting.measure(shown, quick=True)["ng-14"]
    assert set(rows["change"]) == {"dimming", "turning", "lamp off", "lamp on"}
    covered = [0.0] * adapting.BEFORE + [0.5] + [0.0] * (n - adapting.BEFORE - 1)
    hidden = sequence(n, lamp=lamp, covered=covered, attributes={"lamp off": off})
    assert "lamp off" not in set(adapting.measure(hidden, quick=True)["ng-14"]["change"])


def test_an_occluder_at_the_slowest_speed_is_declared_in_time_only_as_the_text_says(sequence):
    rows = sliding.measure(sequence(2), quick=False)["ng-16"]
    assert len(rows) == len(FEATURES) * 3
    assert (rows["declared"] == 1).all()
    assert (rows["contaminated"] == 0).all()
    assert rows["coverage"].between(0.25, 0.35).all()


def test_with_reaches_an_occluder_at_five_per_cent_becomes_the_template(frame):
    wide = np.array([30.0, 20.0, 60.0, 40.0])  # a twentieth is three whole pixels
    images = [sliding.pale(frame(40, 40))] * 30
    patch = Patch(np.full_like(images[0], sliding.DARK_BLUE), wide)
    found = {
        rule: sliding.course_of(images, [wide] * 30, patch, "rgb", rule, 0.05, matched=False)
        for rule in sliding.RULES
    }
    assert found["exceeds"] == {"declared": 1.0, "coverage": pytest.approx(0.3), "contaminated": 0}
    assert found["reaches"]["declared"] == 0
    assert found["reaches"]["contaminated"] > 0.7


def test_targets_as_they_are_are_covered_by_both_rules(sequence):
    rows = sliding.measure_on_targets(sequence(30), quick=True)["ng-16-targets"]
    assert rows["rule"].value_counts().to_dict() == {"exceeds": 3, "reaches": 3}
    assert (rows["declared"] == 1).all()


def test_both_norms_are_tried_on_a_faint_target_under_something_dark(sequence):
    shown = sequence(20)
    images = [sliding.pale(sliding.pale(image)) for image in shown]
    for image in images:
        image[-HEIGHT:, -WIDTH:] = 0  # what is slid over the target
    faint = Sequence("f", images, shown.boxes, fingerprint="f", visibility=shown.visibility)
    rows = norms.measure(faint, quick=True)["ng-19"]
    assert sorted(rows["coverage"].unique()) == [0.1, 0.15, 0.2, 0.25]
    huber, quadratic = (rows[rows["norm"] == norm] for norm in norms.NORMS)
    assert huber["centre_error"].tolist() != quadratic["centre_error"].tolist()
    assert (rows["centre_error"] > 3).all()  # neither norm bounds what such residuals cost


def test_ratios_of_colours_outlast_shade_and_intensity_does_not(sequence):
    rows = shading.measure(sequence(2), quick=False)["ng-21"].set_index(["cause", "features"])
    for cause in ("shade", "shading"):
        change = rows.loc[cause, "change"]
        assert change["invariants"] < 0.1 < change["rgb"]
        assert change["arctan"] < 0.1 < change["intensity"]
    lit = sequence(2)[0][40 : 40 + HEIGHT, 30 : 30 + WIDTH].sum(axis=2)
    # Half of the target lies in half of the light, and so does half of the edge on average.
    expected = 0.5 * lit[:, : WIDTH // 2].mean() / 2 / lit.std()
    assert rows.loc[("shade", "intensity"), "change"] == pytest.approx(expected, rel=0.1)
