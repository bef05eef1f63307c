"""Success, occlusions detected and losses of runs with known boxes; sets of them; their times."""

from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.claims.sides import run_key
from bench.experiments.contestant import contestant
from bench.papers import load_paper
from bench.papers.measures import Course
from bench.papers.nguyen2002 import timing
from bench.papers.nguyen2002.measures import CLIPS, failures_by_margin, of_run, set_table

PAPER = load_paper("nguyen2002")


def course_of(run, truth, trace, loss):
    """What is known of a run whose boxes are off the target for long from a frame on."""
    return of_run(
        Course(run, truth, "made", PAPER.description.tolerance, trace, {"first_loss": loss})
    )


def courses(run, truth, loss=120):
    return {trace: course_of(run, truth, trace, loss) for trace in ("revised", "online")}


def test_a_run_succeeds_on_nine_tenths_of_the_clear_frames_and_on_the_last_five(
    made_run, made_truth
):
    truth = made_truth((40, 60), shown=0.89)
    clear = 120 - 1 - 21
    few = range(1, 1 + int(0.1 * clear))
    for beside, share, success in (
        ((), 1.0, 1.0),
        (range(40, 61), 1.0, 1.0),  # these are not clear
        (few, 1 - len(few) / clear, 1.0),
        ((*few, 10), 1 - (len(few) + 1) / clear, 0.0),
        ((115,), 1 - 1 / clear, 0.0),
        ((114,), 1 - 1 / clear, 1.0),
        ((0,), 1.0, 1.0),  # the given first frame does not count
    ):
        found = course_of(made_run(beside=beside), truth, "online", 120)
        assert found["on_target"] == pytest.approx(share)
        assert found["success"] == success, beside


def test_an_occlusion_is_detected_where_it_was_declared_and_the_target_is_found_again(
    made_run, made_truth
):
    truth = made_truth((30, 45))
    told = ("occlusions", "declared", "detected", "detected_share", "false_occlusions")
    for run, revised, online in (
        (made_run((31, 50, 66)), (1, 1, 1, 1, 0), (1, 1, 1, 1, 0)),
        (made_run((31, 36, 66)), (1, 1, 0, 0, 0), (1, 1, 1, 1, 0)),  # not in view at the end
        (made_run((31, 50, 66), beside=(50,)), (1, 1, 0, 0, 0), (1, 1, 1, 1, 0)),
        (made_run((31, 50, 66), beside=(66,)), (1, 1, 1, 1, 0), (1, 1, 0, 0, 0)),
        (made_run((28, 47, 63), (70, 75, 105)), (1, 1, 1, 1, 1), (1, 1, 1, 1, 1)),
        (made_run((27, 46, 62)), (1, 0, 0, 0, 1), (1, 0, 0, 0, 1)),
        (made_run(), (1, 0, 0, 0, 0), (1, 0, 0, 0, 0)),
        # Of several in an occlusion the last one decides.
        (made_run((30, 35, 65), (40, 59, 75)), (1, 1, 1, 1, 0), (1, 1, 1, 1, 0)),
    ):
        found = courses(run, truth)
        assert tuple(found["revised"][name] for name in told) == revised
        assert tuple(found["online"][name] for name in told) == online


def test_what_the_sequences_end_leaves_open_is_declared_and_not_detected_online(
    made_run, made_truth
):
    found = courses(made_run((100, 111, None)), made_truth((99, 108)))
    assert (found["revised"]["detected"], found["online"]["detected"]) == (1, 0)
    never = courses(made_run((117, None, None)), made_truth((116, 119)))["revised"]
    assert (never["declared"], never["detected"]) == (1, 0)


def test_without_an_occlusion_there_is_no_share_of_them(made_run, made_truth):
    found = course_of(made_run((50, 55, 85)), made_truth(), "revised", 120)
    assert np.isnan(found["detected_share"])
    assert (found["occlusions"], found["false_occlusions"]) == (0, 1)
    assert found["outliers"] == 0.125


@pytest.mark.parametrize(
    ("loss", "switch", "off", "on", "elsewhere"),
    [
        (50, 1, 1, 0, 0),
        (47, 1, 1, 0, 0),
        (53, 1, 1, 0, 0),
        (54, 0, 0, 0, 1),
        (88, 1, 0, 1, 0),
        (96, 0, 0, 0, 1),
    ],
)
def test_a_loss_at_the_moment_of_a_change_is_told_from_others(
    made_run, made_truth, loss, switch, off, on, elsewhere
):
    found = course_of(made_run(), made_truth(off=(50, 90)), "online", loss)
    assert (found["lost_at_switch"], found["lost_at_off"]) == (switch, off)
    assert (found["lost_at_on"], found["lost_elsewhere"]) == (on, elsewhere)
    assert found["never_lost"] == 0
    assert course_of(made_run(), made_truth(), "online", 120)["never_lost"] == 1


def test_a_loss_in_what_was_declared_an_occlusion_is_one_from_its_beginning(made_run, made_truth):
    truth, run = made_truth(off=(50, 90)), made_run((51, 62, 86))
    found = courses(run, truth, loss=70)
    assert (found["revised"]["lost_at_off"], found["online"]["lost_at_off"]) == (0, 1)
    assert course_of(run, truth, "revised", 60)["lost_at_off"] == 1


def test_frames_after_a_lamp_goes_off_count_where_they_are_clear(made_run, made_truth):
    truth = made_truth((60, 64), shown=0.5, off=(50, 90))
    found = course_of(made_run(beside=(49, 55, 62, 69, 70)), truth, "online", 120)
    assert found["clear_after_off"] == 15
    assert found["kept_after_off"] == pytest.approx(13 / 15)
    assert "kept_after_off" not in course_of(made_run(), made_truth(), "online", 120)


def test_what_is_said_to_be_hidden_in_sight_is_a_share_of_the_clear_frames(made_run, made_truth):
    truth = made_truth((40, 60), shown=0.89)
    for found in courses(made_run((30, 35, 65)), truth).values():
        assert found["said_hidden"] == pytest.approx((10 + 4) / (119 - 21))
    assert courses(made_run(), truth)["online"]["said_hidden"] == 0


def test_jitter_is_what_the_estimate_adds_to_the_targets_own_way(made_run, made_truth):
    assert course_of(made_run(), made_truth(), "online", 120)["jitter"] == pytest.approx(0)
    shaken = made_run()
    shaken.boxes[1::2, 1] += 3
    assert course_of(shaken, made_truth(), "online", 120)["jitter"] == pytest.approx(6)
    hidden = course_of(shaken, made_truth((2, 118), shown=0.5), "online", 120)
    assert np.isnan(hidden["jitter"])


RECORDING = "nguyen2002/lights"
ALL = [f"nguyen2002/clip-{number:02}" for number in range(1, 21)]


def scores(fares, sequences=(RECORDING, *ALL), features=("rgb", "invariants"), scenes=2):
    """Runs as written; `fares` gives what is otherwise of features, sequence, scene and trace."""
    rows = []
    for sequence, scene, one in product(sequences, range(scenes), features):
        text = contestant(f"nguyen2002:preset=as-written:features={one}").label
        for trace in ("revised", "online"):
            number = {RECORDING: 3.0, ALL[0]: 2.0}.get(sequence, 1.0)
            known = {"text": text, "settled": run_key(text), "preset": "as-written"}
            known |= {"features": one, "name": f"{sequence}:scene={scene}", "failure": ""}
            known |= {"sequence": sequence, "scene": scene, "trace": trace, "success": 1.0}
            known |= {"occlusions": number, "declared": number, "detected": number}
            known |= {"mean_overlap": 0.9, "on_target": 0.9}
            rows.append(known | fares(one, sequence, scene, trace))
    return pd.DataFrame(rows)


def test_a_set_of_clips_counts_what_was_tracked_and_detected_and_has_the_papers_numbers_beside():
    def fares(features, sequence, scene, trace):
        lost = sequence == ALL[-1] and trace == "online"
        return {"success": 0.0, "detected": 0.0, "mean_overlap": 0.5} if lost else {}

    sets = set_table(scores(fares)).set_index(["sequence", "features", "trace", "scene"])
    assert len(sets) == 2 * 2 * 2 * 2
    whole, online = (sets.loc[(CLIPS, "rgb", trace, 1)] for trace in ("revised", "online"))
    assert whole[["clips", "tracked", "detected"]].tolist() == [20, 20, 21]
    assert online[["tracked", "occlusions", "declared", "detected"]].tolist() == [19, 21, 21, 20]
    assert online["tracked_share"] == 0.95
    assert online["detected_share"] == pytest.approx(20 / 21)
    assert online["mean_overlap"] == pytest.approx(0.88)
    assert online[["published_tracked", "published_detected"]].tolist() == [16, 17]
    assert sets.loc[(RECORDING, "rgb", "online", 0), ["clips", "detected"]].tolist() == [1, 3]


def test_a_set_without_one_of_its_clips_is_none():
    def fares(features, sequence, scene, trace):
        return {"failure": "why" * ((features, sequence, scene) == ("rgb", ALL[6], 1))}

    clips = set_table(scores(fares)).query(f"sequence == {CLIPS!r}")
    found = clips.groupby("features")["scene"].unique().map(list).to_dict()
    assert found == {"invariants": [0, 1], "rgb": [0]}


def test_failures_go_with_what_the_invariants_lose_of_the_margin_set_by_set():
    seen = ALL[:5]

    def fares(features, sequence, scene, trace):
        """All clips fare alike in the end; in the second set they fail the other way round."""
        if features == "rgb" or trace == "revised":
            return {}
        if sequence not in seen:
            return {"on_target": 0.5}  # its margin was not measured
        number = seen.index(sequence)
        return {"on_target": 0.9 - 0.01 * number**2 if scene == 0 else 0.1 + 0.2 * number}

    margins = pd.DataFrame(
        {"name": f"{clip}:scene={scene}", "features": features, "margin": 1.0 - lost}
        for scene in range(2)
        for number, clip in enumerate(seen)
        for features, lost in (("rgb", 0.0), ("invariants", 0.1 * number), ("arctan", 9.0))
    )
    found = failures_by_margin(margins, scores(fares, ALL[:6]))
    assert found["correlation"].tolist() == pytest.approx([1, 0, -1, 0])
    assert found["pairs"].tolist() == ["of a clip", "by chance"] * 2
    assert found["scene"].tolist() == [0, 0, 1, 1]
    assert set(found["sequence"]) == {CLIPS}
    assert set(found["trace"]) == {"online"}
    assert set(found["clips"]) == {5}
    none = failures_by_margin(margins, scores(fares, ALL[:6], ["rgb"]))
    assert none.empty
    assert list(none) == list(found)


@pytest.mark.parametrize(
    ("disturbed", "milliseconds"), [((0, 0), 3.0), ((0, 1), 2.0), ((1, 1), 3.0)]
)
def test_times_are_of_runs_that_no_load_disturbed_where_there_are_any(
    made_run, monkeypatch, disturbed, milliseconds
):
    """One occlusion, at whose end a frame takes ten times as long; the second run is slower."""
    details, frames = made_run((31, 50, 66)).details, []
    for slower, load in zip((1.0, 2.0), disturbed, strict=True):
        seconds = np.full(120, 2e-3 * slower)
        seconds[66], seconds[31:66] = 20e-3 * slower, 1e-3 * slower
        rows = {"seconds": seconds, "revision": details["revision"], "disturbed": load}
        rows |= {"decoded": 2 * seconds, "frame": range(120), "repetition": slower}
        frames.append(pd.DataFrame(rows | {"occluded": details["occluded"]})[1:])
    told = pd.concat(frames).assign(tracker="nguyen2002:preset=as-written:features=rgb")
    told = told.assign(sequence="s")
    monkeypatch.setattr(timing, "frame_times", lambda *_: told)
    context = SimpleNamespace(results=Path("r"), asked={timing.EXPERIMENT: set()})
    (row,) = timing.tables(context)["ng-10"].to_dict("records")
    assert (row["preset"], row["features"]) == ("as-written", "rgb")
    assert row["disturbed"] == min(disturbed)
    kept = told.loc[told["disturbed"] == min(disturbed), "seconds"]
    assert row["milliseconds"] == pytest.approx(1e3 * kept.mean())
    assert row["decoded"] == pytest.approx(2e3 * kept.mean())
    assert row["low"] < row["decoded"] < row["high"]
    assert row["usual"] == pytest.approx(milliseconds)
    assert row["burst"] == pytest.approx(10 * milliseconds)
    assert row["burst_in_usual"] == pytest.approx(10)
    monkeypatch.setattr(timing, "frame_times", lambda *_: told[:0])
    assert timing.tables(context) == {}
    assert timing.tables(SimpleNamespace(results=Path("r"), asked={})) == {}
