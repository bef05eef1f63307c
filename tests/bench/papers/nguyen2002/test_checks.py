"""What is measured for single claims, on painted targets whose truth is known."""

import numpy as np
import pytest

import datasets
import trackers
from bench.papers.nguyen2002.checks import (
    adapting,
    changed,
    clutter,
    contamination,
    corners,
    examining,
    norms,
    sensor,
    shading,
    sliding,
)
from bench.papers.nguyen2002.checks.follower import FEATURES, Follower, true_pose
from bench.papers.nguyen2002.checks.made_up import Patch, clear_frames, dimmed, turned, wholly_seen
from bench.papers.nguyen2002.checks.watching import measure
from datasets import Sequence
from trackers.template.matching import Pose

ROWS, COLUMNS, WIDTH, HEIGHT = 120, 160, 30, 24


def smooth(seed, rows, columns):
    """A picture of soft, coloured blobs."""
    generator = np.random.default_rng(seed)
    coarse = generator.uniform(40, 215, (rows // 6 + 2, columns // 6 + 2, 3))
    down, across = np.linspace(0, len(coarse) - 1.001, rows), np.linspace(
        0, coarse.shape[1] - 1.001, columns
    )  # fmt: skip
    i, j = down.astype(int), across.astype(int)
    u, v = (down - i)[:, None, None], (across - j)[None, :, None]
    upper = (1 - v) * coarse[i][:, j] + v * coarse[i][:, j + 1]
    lower = (1 - v) * coarse[i + 1][:, j] + v * coarse[i + 1][:, j + 1]
    return (1 - u) * upper + u * lower


GROUND, TARGET = smooth(0, ROWS, COLUMNS), smooth(1, HEIGHT, WIDTH)


def frame(x, y, *, covered=0.0, lamp=1.0, seed=0, round_target=False):
    """The target at a place, with a grey thing over a share of it from the left, and noise."""
    image = GROUND.copy()
    there = image[y : y + HEIGHT, x : x + WIDTH]
    there[disc() if round_target else slice(None)] = TARGET[disc() if round_target else slice(None)]
    edge = round(covered * WIDTH)
    image[y - 4 : y + HEIGHT + 4, x - 20 : x + edge] = (
        (90, 30, 200) if covered else image[y - 4 : y + HEIGHT + 4, x - 20 : x + edge]
    )
    noise = np.random.default_rng(seed).normal(0, 2, image.shape)
    return np.clip(np.round(lamp * image + noise), 0, 255).astype(np.uint8)


def disc():
    down, across = np.indices((HEIGHT, WIDTH)) + 0.5
    return ((down / HEIGHT - 0.5) ** 2 + (across / WIDTH - 0.5) ** 2) < 0.25


def sequence(n=50, *, covered=None, lamp=None, round_target=False, attributes=None):
    """The target moves to the right and down; shares that are covered, and light, by frame."""
    covered = covered or [0.0] * n
    lamp = lamp or [1.0] * n
    xs, ys = [30 + t for t in range(n)], [40 + t // 3 for t in range(n)]
    images = [
        frame(x, y, covered=share, lamp=light, seed=t, round_target=round_target)
        for t, (x, y, share, light) in enumerate(zip(xs, ys, covered, lamp, strict=True))
    ]

    def mask(t):
        found = np.zeros((ROWS, COLUMNS), bool)
        found[ys[t] : ys[t] + HEIGHT, xs[t] : xs[t] + WIDTH] = disc() if round_target else True
        return found

    return Sequence(
        "painted", images, [[x, y, WIDTH, HEIGHT] for x, y in zip(xs, ys, strict=True)],
        fingerprint="p", visibility=1 - np.array(covered), masks=mask, attributes=attributes,
    )  # fmt: skip


def occluded(n=60, begin=15, speed=0.1, hidden=8):
    """Covered from a frame on, wholly for some frames, then free from one frame to the next."""
    sliding_in = [min(1.0, speed * (t + 1)) for t in range(int(1 / speed) + hidden)]
    covered = [0.0] * begin + sliding_in
    return sequence(n, covered=covered + [0.0] * (n - len(covered)))


@pytest.mark.parametrize("features", FEATURES)
def test_a_follower_sees_what_the_tracker_sees(features):
    shown = sequence(25)
    tracker = trackers.create(
        "nguyen2002", np.random.SeedSequence(0), preset="as-written", features=features,
        report="raw",
    )  # fmt: skip
    tracker.init(shown[0], shown.boxes[0])
    follower = Follower(shown[0], shown.boxes[0], features)
    for t in range(1, 25):
        said, view = tracker.update(shown[t]), follower.look(shown[t])
        follower.take(view)
        assert said.visible
        np.testing.assert_allclose(follower.box(view.pose), said.box)
        assert view.seen.share == said.details["outliers"]
        assert view.cost == pytest.approx(said.details["cost"])
        assert np.trace(follower.appearance.state) == said.details["state_noise"]


def test_a_follower_finds_a_target_again_where_the_tracker_does():
    n, begin, end = 40, 15, 25
    xs = [30 + 2 * min(t, begin) for t in range(n)]  # it stops while it is hidden
    images = [
        frame(x, 40, seed=t) if not begin < t < end else frame(x, 40, covered=1.0, seed=t)
        for t, x in enumerate(xs)
    ]
    tracker = trackers.create(
        "nguyen2002", np.random.SeedSequence(0), preset="as-written", features="rgb", report="raw",
        longest_occlusion=19,
    )  # fmt: skip
    box = np.array([xs[0], 40.0, WIDTH, HEIGHT])
    tracker.init(images[0], box)
    revised = {}
    for t, image in enumerate(images[1:], 1):
        said = tracker.update(image)
        revised |= {t: said.box, **(said.revised or {})}
    follower = Follower(images[0], box, "rgb", longest_occlusion=19)
    for beginning in range(1, n):
        view = follower.look(images[beginning])
        if view.seen.share > 0.25:
            break
        follower.take(view)
    looks = {m: follower.look(images[beginning + m], m) for m in follower.settings.offsets}
    offset = min(looks, key=lambda m: looks[m].cost)
    np.testing.assert_allclose(follower.box(looks[offset].pose), revised[beginning + offset])
    assert abs(revised[beginning + offset][0] - xs[-1]) < 1.5
    ended = beginning + offset
    follower.restart_after(images[ended], looks[offset].pose, offset + 1)
    view = follower.look(images[ended + 1])
    np.testing.assert_allclose(follower.box(view.pose), revised[ended + 1])
    speed = follower.look(images[ended], 1).pose.x - looks[offset].pose.x
    assert abs(speed) < 1  # at rest again


def test_a_template_that_begins_anew_goes_on_as_it_went():
    shown = sequence(30)
    follower = Follower(shown[0], shown.boxes[0], "rgb")
    pose = true_pose(shown.boxes[0], shown.boxes[2])
    follower.restart_after(shown[2], pose, 2)
    beside = follower.match(shown[2], pose, 4).pose
    assert beside.x == pytest.approx(pose.x, abs=1)
    # Nine frames on it is 10 pixels farther, where a search of 4 pixels about a guess must begin.
    assert follower.predicted(9).x == pytest.approx(pose.x + 10)
    assert follower.predicted(0) == pytest.approx((pose.x + 1, pose.y, 1.0))


def test_the_gain_is_what_the_template_moves_by_towards_the_view():
    shown = sequence(12)
    follower = Follower(shown[0], shown.boxes[0], "rgb")
    for t in range(1, 12):
        view, before = follower.look(shown[t]), follower.appearance.template.copy()
        follower.take(view)
        taken = ~view.seen.outliers
        moved = (follower.appearance.template - before)[taken]
        residuals = (view.seen.features - before)[taken]
        np.testing.assert_allclose(moved, residuals @ follower.gain.T, atol=1e-9)


def test_a_template_is_compared_with_the_truth_where_the_target_truly_is():
    shown = sequence(10)
    follower = Follower(shown[0], shown.boxes[0], "rgb")
    np.testing.assert_array_equal(
        follower.truth(shown[9], shown.boxes[9]),
        shown[9][43 : 43 + HEIGHT, 39 : 39 + WIDTH, ::-1],
    )
    noise = follower.errors(shown[9], shown.boxes[9]).mean()
    follower.appearance.template += 10
    assert 0 < noise < follower.errors(shown[9], shown.boxes[9]).mean()
    assert follower.on_template(shown.mask(9), shown.boxes[9]).all()
    assert follower.on_template(shown.mask(9), shown.boxes[9] + [10, 0, 0, 0]).mean() == 20 / 30


def test_a_patch_slides_over_the_share_that_is_asked_for():
    shown = sequence(2)
    patch = Patch(shown[0], shown.boxes[0])
    for share in (0.0, 0.1, 0.5, 1.0):
        image, mask = patch.slid_over(shown[1], shown.boxes[1], share)
        x, y = shown.boxes[1, :2].astype(int)
        inside = mask[y : y + HEIGHT, x : x + WIDTH]
        assert inside.mean() == pytest.approx(share)
        assert inside[:, : round(share * WIDTH)].all()
        assert (image[~mask] == shown[1][~mask]).all()
        if share:
            assert (image[mask] != shown[1][mask]).mean() > 0.5
    part = np.array([0.2, 0.25, 0.4, 0.5])
    _, mask = patch.stuck_on(shown[1], shown.boxes[1], part)
    assert np.argwhere(mask).min(axis=0).tolist() == [46, 37]
    assert mask.sum() == 12 * 12


def test_what_slides_moves_with_its_edge():
    shown = sequence(2)
    patch = Patch(shown[0], shown.boxes[0])
    x, y = shown.boxes[1, :2].astype(int)
    (half, _), (more, _) = (patch.slid_over(shown[1], shown.boxes[1], s) for s in (0.5, 0.6))
    assert (half[y, x + 5 : x + 15] == more[y, x + 8 : x + 18]).all()


def test_clear_frames_are_those_in_which_as_much_is_seen_as_ever():
    covered = [0.02] * 10 + [0.3] * 5 + [0.02] * 15
    off = np.arange(30) >= 22
    shown = sequence(30, covered=covered, attributes={"lamp off": off})
    assert np.flatnonzero(clear_frames(shown)).tolist() == [*range(10), *range(15, 30)]
    assert np.flatnonzero(clear_frames(shown, 3)).tolist() == [
        *range(3, 10), *range(18, 22), *range(25, 30),
    ]  # fmt: skip
    part = wholly_seen(shown, 5, 9)
    assert part.boxes[0].tolist() == shown.boxes[0].tolist()
    assert len(part) == 9
    assert len(wholly_seen(shown, 5, 50)) == 10
    assert wholly_seen(shown, 11, 20) is None


def test_light_and_orientation_are_changed_about_the_target():
    shown = sequence(2)
    assert dimmed(shown[0], 0.5).mean() == pytest.approx(shown[0].mean() / 2, abs=0.5)
    box = shown.boxes[0]
    half_turn = turned(shown[0], box, 180)
    here = half_turn[40 : 40 + HEIGHT, 30 : 30 + WIDTH].astype(int)
    there = shown[0][40 : 40 + HEIGHT, 30 : 30 + WIDTH][::-1, ::-1]
    assert np.abs(here - there).max() <= 1


def test_a_target_that_clutter_repeats_has_no_margin():
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


def test_outliers_tell_what_is_hidden_and_an_occlusion_ends_where_it_is_over():
    shown = occluded()
    tables = measure(shown, quick=False)
    frames = tables["ng-15"]
    assert set(frames["features"]) == set(FEATURES)
    hidden = frames["hidden"] == 1
    assert (frames["visibility"][hidden] < 0.5).all()
    assert frames["exceeds"][hidden].mean() > 0.95
    assert frames["stays_below"][frames["visibility"] == 1].mean() > 0.9
    assert (frames["exceeds"] + frames["stays_below"] == 1).all()
    ends = tables["ng-17"]
    assert ends["candidates"].value_counts().to_dict() == {"skipped": 4, "all": 4}
    assert ends["beginning"].between(15, 19).all()
    assert (ends[["in_view", "found"]] == 1).all(axis=None)
    assert (ends["beginning"] + ends["offset"] >= 33).all()
    assert ends.loc[ends["candidates"] == "skipped", "offset"].isin([5, 7, 11, 19, 35]).all()
    times = tables["ng-17-times"]
    assert (times["all_seconds"] > 2 * times["skipped_seconds"]).all()


def test_every_frame_is_compared_once_and_hidden_where_half_of_the_target_is():
    frames = measure(occluded(), quick=False)["ng-15"]
    for _, rows in frames.groupby("features"):
        assert rows["frame"].tolist() == list(range(1, 60))
    assert (frames["hidden"] == (frames["visibility"] < 0.5)).all()
    assert frames["visibility"].between(0.1, 0.49).any()


def test_an_end_is_found_only_where_the_target_is_in_view():
    shown = occluded()
    half = np.where(shown.visibility == 1, 1.0, shown.visibility)
    half[33:] = 0.6  # as if something else hid a part of it from then on
    rows = measure(
        Sequence("half", list(shown), shown.boxes, fingerprint="h", visibility=half), quick=False
    )["ng-17"]
    assert (rows["overlap"] > 0.5).all()
    assert (rows[["in_view", "found"]] == 0).all(axis=None)


def test_a_template_that_is_watched_follows_the_light():
    n = 40
    rows = measure(sequence(n, lamp=[1 - 0.01 * t for t in range(n)]), quick=False)["ng-15"]
    rgb = rows[rows["features"] == "rgb"]
    assert rgb["stays_below"].mean() > 0.9


def test_a_target_that_was_lost_to_its_double_is_given_again():
    n, jump = 40, 15
    xs = [30 + t + 45 * (t >= jump) for t in range(n)]
    images = [frame(x, 40, seed=t) for t, x in enumerate(xs)]
    for t in range(jump, jump + 6):
        images[t][40 : 40 + HEIGHT, 30 + t : 30 + t + WIDTH] = images[t][
            40 : 40 + HEIGHT, xs[t] : xs[t] + WIDTH
        ]
    boxes = [[x, 40, WIDTH, HEIGHT] for x in xs]
    shown = Sequence("double", images, boxes, fingerprint="d", visibility=np.ones(n))
    rows = measure(shown, quick=False)["ng-15"]
    assert rows.loc[rows["features"] == "rgb", "stays_below"].all()


def test_a_gate_keeps_what_hides_the_target_out_of_the_template():
    tables = contamination.measure(sequence(31), quick=True)
    short, longer = (table.set_index("gate") for table in tables.values())
    assert short.loc["on", "template_error"] < short.loc["off", "template_error"]
    assert short.loc["on", "covered_error"] < 0.1 * short.loc["off", "covered_error"]
    # After n_omax frames what hides the target is taken for the target.
    assert longer.loc["on", "covered_error"] > 0.5 * longer.loc["off", "covered_error"]


def test_corners_of_a_round_target_are_outliers():
    rows = corners.measure(sequence(30, round_target=True), quick=True)["ng-12"].set_index("part")
    assert rows["background"].tolist() == [pytest.approx(1 - disc().mean())] * 2
    assert rows.loc["corners", "flagged"] > rows.loc["three times inside", "flagged"]
    shown = sequence(15, round_target=True)
    outer, inner = corners._flagged(Follower(shown[0], shown.boxes[0]), shown)
    assert outer > 3 * inner > 0
    shown = corners.measure(shown, quick=True)["ng-12"]
    assert shown["flagged"].tolist() == pytest.approx([outer, 3 * inner])
    assert corners.measure(sequence(30), quick=True) == {}


def test_pixels_that_changed_for_good_stay_outliers_unless_they_are_taken_anew():
    rows = changed.measure(sequence(35), quick=True)["ng-13"].set_index("rebootstrap")
    assert rows.loc["off", "flagged"] > 0.8
    assert rows.loc["on", "flagged"] < 0.2
    assert (rows["flagged_others"] < 0.2).all()


def test_a_template_of_adaptive_noise_follows_the_light():
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


def test_a_lamp_that_is_switched_is_a_change_where_the_target_is_clear():
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


def test_an_occluder_at_the_slowest_speed_is_declared_in_time_only_as_the_text_says():
    rows = sliding.measure(sequence(2), quick=False)["ng-16"]
    assert len(rows) == len(FEATURES) * 3
    assert (rows["declared"] == 1).all()
    assert (rows["contaminated"] == 0).all()
    assert rows["coverage"].between(0.25, 0.35).all()


def test_with_reaches_an_occluder_at_five_per_cent_becomes_the_template():
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


def test_targets_as_they_are_are_covered_by_both_rules():
    rows = sliding.measure_on_targets(sequence(30), quick=True)["ng-16-targets"]
    assert rows["rule"].value_counts().to_dict() == {"exceeds": 3, "reaches": 3}
    assert (rows["declared"] == 1).all()


def test_both_norms_are_tried_on_a_faint_target_under_something_dark():
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


def test_ratios_of_colours_outlast_shade_and_intensity_does_not():
    rows = shading.measure(sequence(2), quick=False)["ng-21"].set_index(["cause", "features"])
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
    noisy = sensor.Noisy(shown.frames, 4.0)
    assert (noisy[3] == noisy[3]).all()
    assert (noisy[3].astype(float) - shown[3]).std() == pytest.approx(4, abs=0.2)
    rows = sensor.measure(shown, quick=True)["ng-22"]
    assert sorted(rows["noise"].unique()) == [1, 2, 4, 8]
    assert rows.groupby("trace").size().tolist() == [8, 8]
    assert (rows.loc[rows["false_occlusions"] == 0, "mean_overlap"] > 0.8).all()


def test_a_flash_is_one_false_occlusion_which_is_made_up_for_in_the_end():
    flash = sequence(30, lamp=[0.3 if t == 12 else 1.0 for t in range(30)])
    rows = sensor.measure(flash, quick=True)["ng-22"].query("features == 'rgb' and noise == 1")
    assert rows["false_occlusions"].tolist() == pytest.approx([100 / 29] * 2)
    revised, online = (rows.loc[rows["trace"] == t, "mean_overlap"].item()
                       for t in ("revised", "online"))  # fmt: skip
    assert revised > online


def test_the_true_pose_has_the_scale_of_the_box():
    pose = true_pose(np.array([0.0, 0.0, 20.0, 10.0]), np.array([5.0, 5.0, 30.0, 15.0]))
    assert pose == (19.5, 12.0, 1.5)


def test_sequences_that_are_measured_exist_and_further_claims_wait():
    known = set(datasets.names())
    assert {name for check in examining.CHECKS for name in check.sequences} <= known
    always = {check.measure.__module__.rpartition(".")[2] for check in examining.CHECKS
              if not check.everything}  # fmt: skip
    assert always == {"clutter", "watching", "sliding"}
