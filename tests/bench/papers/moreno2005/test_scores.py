"""Stored runs become rows; text forms become methods, variants and readings."""

import numpy as np
import pytest

import bench
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.moreno2005.learnt import by_deviations
from bench.papers.moreno2005.scores import (
    _labels_on,
    as_frozen,
    labels_of,
    similar_patches,
    tidy_scores,
)
from bench.store.results import Results

WRITTEN = "moreno2005:preset=as-written"


def test_a_trackers_text_says_which_method_under_which_reading():
    found = {
        text: tuple(labels_of(text).values())
        for text in (
            WRITTEN,
            "moreno2005:association=uniform:colour_dynamics=diagonal",
            "moreno2005:plane_temperature=0.1:colour_temperature=0.1",
            f"{WRITTEN}:snake=false:position=kalman",
            "moreno2005:mean_spread=0.07",
        )
    }
    assert list(found.values()) == [
        ("as-written", "any", "any", "proposed", ""),
        ("recommended", "any", "any", "association=uniform", "colour_dynamics=diagonal"),
        ("recommended", "any", "any", "proposed", "colour_temperature=0.1:plane_temperature=0.1"),
        ("as-written", "any", "any", "position=kalman:snake=false", ""),
        ("recommended", "any", "any", "other deviations", ""),
    ]
    assert list(labels_of(WRITTEN)) == ["preset", "mixing", "plane", "method", "variant"]


def test_a_plane_that_stays_is_another_method_than_one_that_goes_on_at_random():
    fixed = "plane_samples=1:plane_spread=0"
    for text in ("moreno2005", WRITTEN):
        assert labels_of(f"{text}:{fixed}")["method"] == fixed
        assert labels_of(f"{text}:plane_samples=1")["method"] == "plane_samples=1"
        assert labels_of(f"{text}:plane_spread=0")["method"] == "other deviations"


def test_what_was_frozen_is_told_from_moderate_clutter(made_scores):
    where = [
        ("moreno2005/ellipse", {"clutter": "dense"}),
        ("moreno2005/octopus", {}),
        ("moreno2005/ellipse", {"clutter": "moderate"}),
    ]
    frozen = as_frozen(made_scores(lambda run: {}, [WRITTEN], where, scenes=1, runs=1))
    assert frozen["clutter"].tolist() == ["dense", ""]


def test_the_clutter_of_the_ellipse_is_known_without_being_named():
    found = [
        _labels_on(f"moreno2005/{name}")["clutter"]
        for name in ("ellipse", "ellipse:clutter=moderate", "leaf")
    ]
    assert found == ["dense", "moderate", ""]


def test_the_baselines_a_and_plane_are_readings_and_its_preset_is_the_methods():
    found = [
        tuple(labels_of(f"contour-smooth-color{options}").values())
        for options in ("", ":mixing=0.5", ":mixing=1:plane=refitted", ":preset=as-written")
    ]
    assert found == [
        ("recommended", "1", "first", "baseline", ""),
        ("recommended", "0.5", "first", "baseline", ""),
        ("recommended", "1", "refitted", "baseline", ""),
        ("as-written", "1", "first", "baseline", ""),
    ]


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    texts = ("moreno2005:contour_samples=20:colour_samples=20", "contour-smooth-color:mixing=0.5")
    source = SequenceSource("plain/target:length=12")
    return bench.run(Experiment("trial", texts, (source,)), tmp_path_factory.mktemp("x"), jobs=1)


def test_every_run_is_a_row_with_what_its_masks_show(stored):
    scores = tidy_scores(stored)
    assert sorted(scores["method"]) == ["baseline", "proposed"]
    results = Results(stored)
    for _, row in scores.iterrows():
        similarity = results.read(results.folder / row["path"]).segmentation.region_similarity
        assert row["mean_region_similarity"] == np.nanmean(similarity[1:])
        assert row["least_similarity"] == np.nanmin(similarity)
        below = np.flatnonzero(similarity < 0.5)
        assert row["first_loss"] == (below[0] if len(below) else 12)
    known = scores[["light", "illuminant", "shadow", "jump", "set", "kept_scene"]]
    assert known.drop_duplicates().iloc[0].tolist() == ["even", "", "", "", "any", True]


def test_a_failed_run_has_a_row_without_a_course(stored, tmp_path):
    results = Results(stored)
    file = next(path for path in results.files() if "smooth" in str(path))
    run = results.read(file)
    results.remove([str(file.relative_to(stored))])
    results.write(bench.Run(**{**vars(run), "failure": "frame 3: it broke"}))
    results.prepare(results.asked())
    scores = tidy_scores(stored).set_index("method")
    assert "it broke" in scores.loc["baseline", "failure"]
    assert np.isnan(scores.loc["baseline", "first_loss"])
    assert scores.loc["proposed", "failure"] == ""


def test_similar_patches_make_two_rows_of_a_run_of_the_method(made_scores):
    def fares(run):
        near = 0.5 if run.scene < 2 else np.nan
        return {"near_patch": near, "elsewhere": 0.8}

    table = similar_patches(made_scores(fares, scenes=3, runs=1))
    assert set(table["method"]) == {"proposed"}
    assert set(table["scene"]) == {0, 1}
    means = table.groupby("patch")["region_similarity"].mean()
    assert means.to_dict() == pytest.approx({"touching": 0.5, "apart": 0.8})


def test_runs_are_told_apart_by_whose_deviations_they_have(made_scores):
    texts = [WRITTEN, "moreno2005", f"{WRITTEN}:mean_spread=0.07", "moreno2005:mean_spread=0.07"]
    table = by_deviations(made_scores(lambda run: {}, texts, scenes=1, runs=1))
    kinds = table.groupby("text")["deviations"].first()
    assert [kinds[text] for text in texts] == ["learnt", "by hand", "by hand", "learnt"]
