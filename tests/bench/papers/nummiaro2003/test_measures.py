"""What happened in a run whose story is known, and the claims whose tests are the paper's own."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.claims.conclusion import conclude
from bench.claims.judging import judge
from bench.claims.ledger import read_claims
from bench.claims.sides import run_key
from bench.papers.nummiaro2003.measures import (
    CHECKS,
    NAMES,
    Hiding,
    hidings,
    of_run,
    scores,
    tables,
)

N, COMES, LEAVES = 240, 20, 230
TREE = slice(100, 116)
SHORT = slice(180, 184), slice(200, 203)


def truth(**changes):
    """A target that comes, is hidden by a tree and twice by others, and leaves."""
    boxes = np.full((N, 4), np.nan)
    frames = np.arange(COMES, LEAVES)
    boxes[frames] = np.column_stack([3.0 * frames, *np.tile([[50.0], [40.0], [90.0]], len(frames))])
    visibility = np.ones(N)
    visibility[TREE] = 0.0
    visibility[96:100] = visibility[116:120] = 0.6
    for one in SHORT:
        visibility[one] = 0.2
    visibility[:COMES] = visibility[LEAVES:] = 0.0
    visibility[LEAVES - 3 : LEAVES] = 0.3
    return SimpleNamespace(**{"boxes": boxes, "regions": {}, "visibility": visibility, **changes})


def measured(boxes=None, there=None, silent=False, **details):
    """What is said of a run that follows the truth and sees what it says, but for the changes."""
    usual = {
        "mode": np.ones(N),
        "positive_appearances": np.where(truth().visibility > 0.1, 90.0, 3.0),
        "updated": (truth().visibility > 0.5).astype(float),
    }
    told = {key: np.asarray(value, float) for key, value in {**usual, **details}.items()}
    run = SimpleNamespace(
        boxes=np.nan_to_num(truth().boxes, nan=1.0) if boxes is None else boxes,
        details={} if silent else told,
        identity=SimpleNamespace(parameters={"kick_off": 0.1, "particles": 100}),
    )
    return of_run(SimpleNamespace(run=run, truth=there or truth()))


def shifted(frames, by=500.0):
    boxes = np.nan_to_num(truth().boxes, nan=1.0)
    boxes[frames, 0] += by
    return boxes


def test_hidings_are_told_by_how_completely_and_leaving_is_none():
    expected = [Hiding(100, 116, True), Hiding(180, 184, False), Hiding(200, 203, False)]
    assert hidings(truth().visibility, COMES, LEAVES) == expected
    assert hidings(np.ones(N), COMES, LEAVES) == []
    assert hidings(np.full(N, np.nan), COMES, LEAVES) == []


def test_a_run_as_the_paper_tells_it():
    mode = np.ones(N)
    mode[104:118] = 0
    found = measured(mode=mode)
    assert set(found) == set(NAMES)
    assert found["frames"] == found["first_loss"] == LEAVES - COMES
    for event in ("recovered", "count_fell", "initialised", "tracking_again", "bridged"):
        assert found[event] == 1.0, event
    assert found["right_at_end"] == found["count_fell_at_end"] == 1.0
    assert found["size_error"] == found["size_bias"] == found["centre_rms"] == 0.0
    assert np.isnan(found["size_correlation"])  # neither size changes
    # It initialises in two good frames and in twelve others.
    assert found["good_updates"] == found["good_frames"] == LEAVES - COMES - 1 - 16 - 4 - 3 - 3 - 2
    assert found["other_updates"] == 0.0
    assert (found["waiting_frames"], found["count_fell_shortly"]) == (12, 0.0)
    assert found["good_frames"] + found["other_frames"] == N - COMES - 1 - 14
    assert found["update_share"] == found["good_frames"] / (N - COMES - 1 - 14)


FRAMES = np.arange(N)
HIDDEN_FRAMES = 16 + 4 + 3 + 3


def but(usual, frames, value):
    """The same number in all frames but some."""
    return np.where(np.isin(FRAMES, FRAMES[frames]), value, usual)


def for_a_moment():
    """Beside the target from the tree on, but for four frames in a row."""
    boxes = shifted(slice(100, N))
    boxes[125:129] = truth().boxes[125:129]
    return boxes


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        # Lengths and losses count the frames alone in which the target is there.
        ({"boxes": shifted(slice(50, N))}, {"first_loss": 30, "frames": LEAVES - COMES}),
        ({"boxes": shifted(slice(0, N))}, {"first_loss": 1}),  # that of the given frame
        # A target that is found too late, or for a moment, is not recovered,
        ({"boxes": shifted(slice(100, 151))}, {"recovered": 0}),
        ({"boxes": shifted(slice(100, 140))}, {"recovered": 1}),
        ({"boxes": for_a_moment()}, {"recovered": 0, "right_at_end": 0, "bridged": np.nan}),
        # nor is one that walks through a frozen box.
        ({"mode": but(1, slice(104, N), 0)}, {"recovered": 0, "bridged": np.nan}),
        ({"mode": but(1, slice(104, 140), 0)}, {"recovered": 1}),
        # Frames in which nothing can be updated are no credit to the condition,
        (
            {"updated": but(1, slice(LEAVES, N), 0), "mode": but(1, slice(LEAVES, N), 0)},
            {"other_updates": HIDDEN_FRAMES, "other_frames": HIDDEN_FRAMES}
            | {"waiting_frames": N - LEAVES},
        ),
        # and updates beside the target or in its absence are no good.
        (
            {"boxes": shifted(slice(150, 160)), "updated": np.ones(N)},
            dict.fromkeys(("other_updates", "other_frames"), HIDDEN_FRAMES + (N - LEAVES) + 10),
        ),
        # A count that falls in a short hiding is told where the tracker was on target,
        ({"positive_appearances": but(50, SHORT[1], 9)}, {"count_fell_shortly": 1}),
        (
            {"positive_appearances": but(50, SHORT[1], 9), "boxes": shifted(slice(190, 205))},
            {"count_fell_shortly": 0},
        ),
        # one that stays up falls nowhere.
        (
            {"positive_appearances": np.full(N, 10)},
            {"count_fell": 0, "count_fell_at_end": 0},
        ),
        (
            {"positive_appearances": but(50, slice(LEAVES + 9, LEAVES + 10), 9)},
            {"count_fell_at_end": 1},
        ),
        # Short hidings are bridged by propagation alone.
        ({}, {"bridged": 1}),
        ({"boxes": shifted(slice(181, 200))}, {"bridged": 0}),  # off the target for too long
        ({"boxes": shifted(slice(181, 190))}, {"bridged": 1}),
        ({"mode": but(1, slice(205, 206), 0)}, {"bridged": 0}),  # initialises
        ({"boxes": shifted(slice(170, 195))}, {"bridged": 1}),  # on it before the second alone
    ],
)
def test_what_happened_in_a_run(changes, expected):
    found = measured(**changes)
    assert {name: found[name] for name in expected} == pytest.approx(expected, nan_ok=True)


def test_half_axes_are_told_by_error_bias_and_correlation():
    boxes = truth().boxes
    boxes[COMES:LEAVES, 2] = np.linspace(40, 80, N)[COMES:LEAVES]
    there = truth(boxes=boxes)
    wide = np.nan_to_num(boxes, nan=1.0)
    wide[:, 2] *= np.where(np.arange(N) % 2, 0.9, 0.7)
    found = measured(wide, there)
    assert found["size_error"] == pytest.approx(0.2, abs=0.002)
    assert found["size_bias"] == pytest.approx(-0.2, abs=0.002)
    assert 0.5 < found["size_correlation"] < 1
    assert measured(boxes, there)["size_correlation"] == pytest.approx(1.0)


def test_fast_frames_are_the_fifth_in_which_the_target_moves_most():
    boxes = truth().boxes
    fast = np.zeros(N, bool)
    fast[COMES + 1 : LEAVES : 5] = True
    boxes[:, 0] = np.where(np.isnan(boxes[:, 0]), np.nan, np.cumsum(np.where(fast, 30, 2)))
    lost = np.nan_to_num(boxes, nan=1.0)
    lost[fast, 0] += 500
    found = measured(lost, truth(boxes=boxes))
    assert (found["inside_fast"], found["inside_otherwise"]) == (0.0, 1.0)


def test_a_tracker_that_says_nothing_of_modes_has_its_place_and_size_alone():
    found = measured(silent=True)
    assert found["size_error"] == 0.0
    assert found["inside_partly_hidden"] == 1.0
    known = {name for name, value in found.items() if np.isfinite(value)}
    assert not known & {"recovered", "good_frames", "bridged", "right_at_end"}


WRITTEN = "nummiaro2003:preset=as-written"
OFF, BLIND = "model_update=false", "reinitialise=false"


def rows(**errors):
    """Two repetitions of each text in two scenes; one alone of what has another parameter."""
    texts = [
        *(f"nummiaro2003:{OFF}", WRITTEN, f"{WRITTEN}:{OFF}", f"{WRITTEN}:{BLIND}"),
        *(f"{WRITTEN}:update_reading={name}" for name in ("printed", "variance")),
        *(f"{WRITTEN}:{name}" for name in ("loss_frames=2", "appearance=first", "sigma=0.2")),
        "mean-shift",
    ]
    every = pd.DataFrame(
        {"text": text, "name": f"s:scene={scene}", "light": "even", "repetition": repetition}
        for text in texts
        for scene in range(2)
        for repetition in range(1 if texts.index(text) > 3 and text != "mean-shift" else 2)
    )
    usual = dict.fromkeys(("frames_inside", "success_frames", "first_loss"), 50.0)
    every = every.assign(frames=200, other_frames=3, waiting_frames=1, bridged=np.nan, **usual)
    every["model_update"] = [None if t == "mean-shift" else OFF not in t for t in every["text"]]
    return every.assign(size_error=[errors.get(name, 0.5) for name in every["text"]], copied=False)


def test_runs_serve_all_readings_that_make_no_difference_to_them():
    copies = scores(rows()).query("copied")
    assert copies.groupby("text").size().to_dict() == {
        f"{WRITTEN}:{OFF}:update_reading=printed": 2,  # not `variance`: it changes the weights
        f"{WRITTEN}:loss_frames=2:{BLIND}": 2,
    }
    assert set(copies["repetition"]) == {0}  # as many as of what they are compared with


def test_counts_are_shares_of_the_length_and_scenes_are_set_side_by_side():
    nearer = scores(rows(**{WRITTEN: 0.4})).set_index("text")["nearer_with_update"]
    assert nearer[WRITTEN].tolist() == [1.0] * 4
    assert nearer[[f"{WRITTEN}:{OFF}", "mean-shift"]].isna().all()
    assert nearer.drop([WRITTEN, f"{WRITTEN}:update_reading=printed"]).isna().all()  # are alone
    assert set(scores(rows(**{WRITTEN: 0.6}))["nearer_with_update"].dropna()) == {0.0}
    frame = scores(rows().assign(light=0.0))
    assert set(frame["first_loss_percent"]) == {25.0}
    assert set(frame["light"]) == {"even"}  # what was a cloud's share
    assert set(frame["all_other_frames"]) == {4}
    assert frame["noise"].isna().all()  # which claims name, though no such sequence was tracked


def test_the_model_forgets_exponentially_and_entrances_are_counted_once():
    runs = pd.DataFrame({"preset": "as-written", "kick_off": 0.1, "repetition": range(4)})
    entrance = runs.assign(name="person")
    both = pd.concat([entrance, entrance.assign(kick_off=0.4)])
    made = tables(SimpleNamespace(tables={"entrance": entrance, "kick_off": both}))
    assert made["forgetting"]["difference"].max() < 1e-9
    assert made["entrances"].groupby("kick_off").size().to_dict() == {0.1: 4, 0.4: 4}


CLAIMS = read_claims("nummiaro2003")
SCENES = 12
WOBBLE = np.arange(SCENES) / 1000


def runs_of(options="", sequence="nummiaro2003/traffic", **columns):
    """Runs as written, with other options, in twelve scenes."""
    text = f"nummiaro2003:preset=as-written{options}"
    usual = {
        "tracker": "nummiaro2003",
        "settled": run_key(text),
        "light": "even",
        "sequence": sequence,
        "kept_scene": True,
        "repetition": 0,
        "frames": 100,
        "failure": "",
    }
    return pd.DataFrame({"scene": range(SCENES), **usual, **columns})


def concluded(name, *scores, **tables):
    found = judge(CLAIMS[name], pd.concat(scores or [runs_of()]), tables, CHECKS)
    return conclude(CLAIMS[name], found)


def updates(good, other, options="", others=50, **columns):
    counts = {"good_frames": 100, "other_frames": others, "waiting_frames": 50}
    return runs_of(options, good_updates=good, other_updates=other, **counts, **columns)


@pytest.mark.parametrize(
    ("good", "other", "verdict"),
    [
        (50, 1, "holds"),
        (50, 30, "does not hold"),
        (1, 0, "does not hold"),
        (50, [1, 20] * 6, "inconclusive"),  # five times as high in half of the scenes
    ],
)
def test_an_update_has_its_place_in_good_frames(good, other, verdict):
    found = concluded("NU-9", updates(good, other))
    assert found.verdict == verdict
    assert f"{np.mean(other):.1f} % of the others with the 600 in" in found.reason
    assert concluded("NU-9", updates(good, 0, others=0)).verdict == "inconclusive"


def test_each_reading_of_the_condition_is_judged():
    found = concluded(
        "NU-9",
        updates(50, 0),
        updates(0, 0, ":update_reading=printed"),
        updates(100, 50, ":update_reading=coefficient"),
        updates(0, 0, ":model_update=false"),
    )
    assert (found.verdict, found.readings, found.post_hoc) == ("holds", "1 of 2", "0 of 1")


@pytest.mark.parametrize(
    ("fast", "verdict"), [(0.95, "holds"), (0.5, "does not hold"), (np.nan, "inconclusive")]
)
def test_fast_frames_are_set_against_nine_tenths_of_the_others(fast, verdict):
    frame = runs_of(inside_fast=fast + WOBBLE, inside_otherwise=1.0)
    found = concluded("NU-23", frame)
    assert found.verdict == verdict
    assert found.found.effect.startswith("fast frames less 0.9 of the others: ") != np.isnan(fast)


@pytest.mark.parametrize(
    ("error", "correlation", "verdict"),
    [(0.2, 0.9, "holds"), (0.2, 0.1, "does not hold"), (0.8, 0.9, "does not hold")],
)
def test_size_must_be_nearer_and_follow_better(error, correlation, verdict):
    told = {"size_error": error + WOBBLE, "size_correlation": correlation, "update_share": 0.5}
    without = {"size_error": 0.5, "size_correlation": 0.5, "update_share": 0.0}
    both = runs_of(":model_update=true", **told), runs_of(":model_update=false", **without)
    assert concluded("NU-22", *both).verdict == verdict


def test_rank_correlation_is_judged_by_sequence():
    sequences = [f"s{number}" for number in range(12)] + ["nummiaro2003/person", "nummiaro2003/car"]
    area = np.tile(np.linspace(1, 2, 50), len(sequences))
    table = pd.DataFrame({"sequence": np.repeat(sequences, 50), "area": area})
    for verdict, seconds in (("holds", area**3), ("does not hold", -area)):
        found = concluded("NU-14", frame_times=table.assign(seconds=seconds))
        assert found.verdict == verdict
    few = table[table["sequence"].str.startswith("nummiaro")].assign(seconds=1.0 - area[:100])
    found = concluded("NU-14", frame_times=few)
    assert (found.verdict, found.reason) == ("inconclusive", "only 2 of 12 sequences")
