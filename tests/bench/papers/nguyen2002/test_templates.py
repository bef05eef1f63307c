"""What is done to a painted target shows what the paper says of the template."""

import numpy as np
import pytest

from bench.papers.nguyen2002 import templates
from bench.papers.nguyen2002.follower import FEATURES, Follower, pale
from datasets import Sequence
from tests.bench.papers.nguyen2002.painted import DISC, HEIGHT, WIDTH, sequence


def test_a_gate_keeps_what_hides_the_target_out_of_the_template():
    rows = templates.gates(sequence(31), quick=True)["ng-11"].set_index("gate")
    assert rows.loc["on", "template_error"] < rows.loc["off", "template_error"]
    assert rows.loc["on", "covered_error"] < 0.1 * rows.loc["off", "covered_error"]


def test_corners_of_a_round_target_are_outliers():
    rows = templates.corners(sequence(30, shape=DISC), quick=True)["ng-12"].set_index("part")
    assert rows["background"].tolist() == [pytest.approx(1 - DISC.mean())] * 2
    assert rows.loc["corners", "flagged"] > rows.loc["three times inside", "flagged"] > 0
    assert templates.corners(sequence(30), quick=True) == {}


def test_pixels_that_changed_for_good_stay_outliers_unless_they_are_taken_anew():
    rows = templates.changed(sequence(35), quick=True)["ng-13"].set_index("rebootstrap")
    assert rows.loc["off", "flagged"] > 0.8
    assert rows.loc["on", "flagged"] < 0.2
    assert (rows["flagged_others"] < 0.2).all()


def test_a_template_of_adaptive_noise_follows_the_light():
    n = templates.STEADY + templates.CHANGING
    rows = templates.adaptation(sequence(n), quick=True)["ng-14"]
    assert set(rows["change"]) == {"dimming", "turning"}
    rgb = rows[(rows["features"] == "rgb") & (rows["change"] == "dimming")]
    by = rgb.set_index(["adaptive", "phase"])
    assert (rows.loc[rows["adaptive"] == "off", "state_noise"] == 0).all()
    errors = by["template_error"]
    assert errors["off", "before"] < 0.5 * errors["off", "change"]
    assert by.loc[("on", "change"), "gain"] > by.loc[("off", "change"), "gain"]
    assert by.loc[("on", "change"), "template_error"] < by.loc[("off", "change"), "template_error"]


@pytest.mark.parametrize("features", FEATURES)
def test_the_gain_is_what_inliers_move_by_which_is_half_of_the_first_residuals(features):
    shown = sequence(12)
    follower = Follower(shown[0], shown.boxes[0], features)
    gains = []
    for t in range(1, 12):
        view, before = follower.look(shown[t]), follower.appearance.template.copy()
        follower.take(view)
        gains.append(templates.gain_of(view.seen, before, follower.appearance.template))
    assert gains[0] == pytest.approx(0.5)  # equation 15
    assert 0 < gains[-1] < 0.4  # noise is averaged out


def test_a_lamp_that_is_switched_is_a_change_where_the_target_is_clear():
    n = 2 * (templates.STEADY + templates.CHANGING)
    off = np.zeros(n, bool)
    off[templates.STEADY : n - templates.CHANGING] = True
    lamp = [0.6 if flag else 1.0 for flag in off]
    shown = sequence(n, lamp=lamp, attributes={"lamp off": off})
    rows = templates.adaptation(shown, quick=True)["ng-14"]
    assert set(rows["change"]) == {"dimming", "turning", "lamp off", "lamp on"}
    covered = [0.5 if t == templates.STEADY else 0.0 for t in range(n)]
    hidden = sequence(n, lamp=lamp, covered=covered, attributes={"lamp off": off})
    rows = templates.adaptation(hidden, quick=True)["ng-14"]
    assert "lamp off" not in set(rows["change"])


def test_both_norms_are_tried_on_a_faint_target_under_something_dark():
    shown = sequence(20)
    images = [pale(pale(image)) for image in shown]
    for image in images:
        image[-HEIGHT:, -WIDTH:] = 0  # what is slid over the target
    faint = Sequence("f", images, shown.boxes, fingerprint="f", visibility=shown.visibility)
    rows = templates.by_norm(faint, quick=True)["ng-19"]
    assert sorted(rows["coverage"].unique()) == [0.1, 0.15, 0.2, 0.25]
    huber, quadratic = (rows[rows["norm"] == norm] for norm in templates.NORMS)
    assert huber["centre_error"].tolist() != quadratic["centre_error"].tolist()
    assert (rows["centre_error"] > 3).all()  # neither norm bounds what such residuals cost
