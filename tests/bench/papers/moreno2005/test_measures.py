"""What is measured of a run from its region similarities, and what claims read besides."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import bench
from bench.experiments.contestant import contestant
from bench.experiments.experiment import read_experiment
from bench.papers import load_paper
from bench.papers.measures import Course, measured
from bench.papers.moreno2005.measures import (
    JUMP,
    PATCH,
    PRESETS,
    SERIES,
    deviations,
    of_run,
    patches,
    scores,
)
from bench.papers.runs import tidy_runs
from bench.store.results import Results

N = 40
PAPER = load_paper("moreno2005")
TIMED = "moreno2005-time"


def course(jumps=(), patched=(), **dips):
    """J of .9 after a first frame without any; `dips` by frame, as `f7=.3`."""
    values = np.full(N, 0.9)
    values[0] = np.nan
    for frame, value in dips.items():
        values[int(frame[1:])] = value
    attributes = {
        name: np.isin(np.arange(N), list(frames))
        for name, frames in ((JUMP, jumps), (PATCH, patched))
    }
    run = SimpleNamespace(segmentation=SimpleNamespace(region_similarity=values), details={})
    truth = SimpleNamespace(attributes=attributes, boxes=np.zeros((N, 4)))
    return Course(run, truth, "moreno2005/ellipse", PAPER.description.tolerance)


def found(**what):
    seen = course(**what)
    return measured(seen, PAPER.description, SERIES) | of_run(seen)


def test_a_run_without_a_dip_is_tracked_and_nothing_arose():
    told = found()
    assert (told["first_loss"], told["tracked"], told["gone"]) == (N, 1, 0)
    assert np.isnan([told["lost_by_jump"], told["near_patch"]]).all()
    assert told["elsewhere"] == pytest.approx(0.9)


def test_the_first_frame_below_one_half_ends_tracking():
    told = found(f7=0.49, f9=0.05, f5=0.5)
    assert (told["first_loss"], told["tracked"], told["gone"]) == (7, 0, 1)
    assert found(f7=0.1)["gone"] == 0


@pytest.mark.parametrize(
    ("dips", "jumps", "lost"),
    [
        ({"f10": 0.4}, (1,), 1),
        ({"f10": 0.5}, (1,), 0),
        ({"f9": 0.4, "f11": 0.4}, (1,), 0),
        ({"f29": 0.4}, (20, 25), 1),
        ({"f34": 0.4}, (20, 25), 0),
        ({"f39": 0.1}, (30,), 1),
        ({"f18": 0.1, "f29": 0.1}, (20,), 1),
    ],
)
def test_a_target_is_lost_by_a_jump_if_the_tenth_frame_from_it_is_not_tracked(dips, jumps, lost):
    assert found(jumps=jumps, **dips)["lost_by_jump"] == lost


def test_what_was_lost_before_a_jump_or_is_not_judged_after_it_tells_nothing():
    for what in ({"f19": 0.4, "f29": 0.4, "jumps": (20,)}, {"jumps": (N - 9,)}):
        assert np.isnan(found(**what)["lost_by_jump"])
    assert np.isnan(found(jumps=(20,), f29=np.nan)["lost_by_jump"])


def test_patches_split_the_mean_of_the_frames():
    told = found(patched=(0, 3, 4), f3=0.5, f4=0.7, f5=0.3)
    assert told["near_patch"] == pytest.approx(0.6)
    assert told["elsewhere"] == pytest.approx((0.3 + 36 * 0.9) / 37)


def test_runs_are_rows_with_what_their_masks_show_and_failed_ones_have_no_measures(
    tmp_path, store_runs
):
    texts = ("moreno2005:contour_samples=20:colour_samples=20", "contour-smooth-color:mixing=0.5")
    folder = tmp_path / "trial"
    store_runs(folder, texts, ["plain/target:length=12"])
    results = Results(folder)
    file = next(path for path in results.files() if "smooth" in str(path))
    run = results.read(file)
    results.remove([str(file.relative_to(folder))])
    results.write(bench.Run(**{**vars(run), "failure": "frame 3: it broke"}))
    results.prepare(results.asked())
    runs = tidy_runs(folder, None, PAPER.description, SERIES, of_run).set_index("tracker")
    ours = runs.loc["moreno2005"]
    similarity = results.read(folder / ours["path"]).segmentation.region_similarity
    assert ours["mean_region_similarity"] == np.nanmean(similarity[1:])
    below = np.flatnonzero(similarity < 0.5)
    assert ours["first_loss"] == (below[0] if len(below) else 12)
    failed = runs.loc["contour-smooth-color"]
    assert "it broke" in failed["failure"]
    assert np.isnan(failed["first_loss"])


def test_sequences_are_shown_without_scene_and_trackers_told_apart_without_preset():
    runs = pd.DataFrame(
        {
            "name": ["moreno2005/ellipse:light=jump:scene=3"],
            "text": ["moreno2005:preset=robust:snake=false"],
            "light": "jump",
        }
    )
    row = scores(runs).iloc[0]
    assert row[["shown", "varied", "lighting", "light"]].tolist() == [
        "moreno2005/ellipse:light=jump",
        "snake=false",
        "jump",
        "even",
    ]


def test_similar_patches_make_two_rows_of_a_run_that_met_one():
    runs = pd.DataFrame({"scene": [0, 1, 2], "near_patch": [0.5, 0.4, np.nan], "elsewhere": 0.8})
    table = patches(runs)
    assert table.groupby("patch")["scene"].apply(list).to_dict() == {
        "apart": [0, 1],
        "touching": [0, 1],
    }
    means = table.groupby("patch")["region_similarity"].mean()
    assert means.to_dict() == pytest.approx({"touching": 0.45, "apart": 0.8})


def test_each_preset_runs_with_the_deviations_of_the_other_and_stands_among_its_own():
    exchanged = read_experiment("moreno2005-learnt").trackers
    for text, other in zip(exchanged, reversed(PRESETS), strict=True):
        given, others = contestant(text), contestant(f"moreno2005:preset={other}")
        own = contestant(f"moreno2005:preset={given.preset}")
        for name, value in given.parameters.items():
            source = others if name.endswith("_spread") else own
            assert value == source.parameters[name], name
    texts = ["moreno2005:preset=as-written", "moreno2005", *exchanged]
    runs = pd.DataFrame(
        {
            "text": [contestant(text).label for text in texts],
            "tracker": "moreno2005",
            "preset": ["as-written", "recommended"] * 2,
            "experiments": [",moreno2005-light,"] * 2 + [",moreno2005-learnt,"] * 2,
        }
    )
    table = deviations(runs.assign(settled="own"))
    assert table["deviations"].tolist() == ["learnt", "by hand", "by hand", "learnt"]
    assert table["text"].tolist() == ["moreno2005:preset=as-written", "moreno2005"] * 2
