"""Stored runs become rows by trace, and rows become sets."""

import numpy as np
import pandas as pd
import pytest

import bench
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.nguyen2002.measures import CLIPS, by_sets, set_table
from bench.papers.nguyen2002.scores import COLOURED, LIGHTS, labels_of, tidy_scores
from bench.store.results import Results
from bench.store.truth import read_truth

WRITTEN = "nguyen2002:preset=as-written"


def test_a_trackers_text_says_under_which_reading_it_ran():
    found = {
        text: tuple(labels_of(text).values())
        for text in (
            WRITTEN,
            f"{WRITTEN}:features=rgb",
            "nguyen2002:features=arctan",
            f"{WRITTEN}:features=intensity:longest_occlusion=67",
            "nguyen2002:preset=robust",
            f"{WRITTEN}:report=raw:average=5",
        )
    }
    assert list(found.values()) == [
        ("invariants", "ratio", "as-written", ""),
        ("rgb", "any", "as-written", ""),
        ("invariants", "arctan", "recommended", ""),
        ("intensity", "any", "as-written", "longest_occlusion=67"),
        ("rgb", "any", "robust", ""),
        ("invariants", "ratio", "as-written", "average=5:report=raw"),
    ]
    assert list(labels_of(WRITTEN)) == ["features", "definition", "preset", "variant"]


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    source = SequenceSource("plain/target:length=60:occlusion=0.9:noise=8")
    texts = (f"{WRITTEN}:features=rgb:gamma=0.08", f"{WRITTEN}:features=intensity:gamma=0.9")
    return bench.run(Experiment("trial", texts, (source,)), tmp_path_factory.mktemp("x"), jobs=1)


def test_every_run_is_a_row_a_trace_with_the_scores_of_that_trace(stored):
    scores = tidy_scores(stored)
    assert scores["trace"].value_counts().to_dict() == {"revised": 2, "online": 2}
    rows = scores.set_index(["features", "trace"])
    results = Results(stored)
    for (_, trace), row in rows.iterrows():
        run = results.read(results.folder / row["path"])
        truth = read_truth(stored, run.identity.sequence, run.identity.fingerprint)
        native = bench.score(run, truth, trace=trace)
        assert row["mean_overlap"] == native["mean_overlap"]
        assert row["first_loss"] == native["first_loss"]
    of_rgb = rows.loc["rgb"]
    assert of_rgb.loc["revised", "mean_overlap"] != of_rgb.loc["online", "mean_overlap"]
    assert of_rgb["false_occlusions"].min() > 0
    calm = rows.loc["intensity"]
    assert calm.loc["revised", "mean_overlap"] == calm.loc["online", "mean_overlap"]
    assert set(scores["kept_scene"]) == {True}


def test_a_failed_run_has_a_row_a_trace_without_a_course(tmp_path):
    source = SequenceSource("plain/target:length=10")
    texts = (f"{WRITTEN}:features=rgb", "nguyen2002:search_range=4")
    folder = bench.run(Experiment("trial", texts, (source,)), tmp_path, jobs=1)
    results = Results(folder)
    file = next(path for path in results.files() if "search_range" in str(path))
    run = results.read(file)
    results.remove([str(file.relative_to(folder))])
    results.write(bench.Run(**{**vars(run), "failure": "frame 3: it broke"}))
    results.prepare(results.asked())
    scores = tidy_scores(folder, [("nguyen2002:search_range=4", source.text, 0, "accuracy")])
    assert len(scores) == 2
    assert scores["failure"].str.contains("it broke").all()
    assert "success" not in scores or scores["success"].isna().all()


def test_a_set_of_clips_counts_what_was_tracked_and_detected(made_scores):
    def fares(text, sequence, scene, trace):
        if sequence.endswith("clip-20") and trace == "online":
            return {"success": 0.0, "detected": 0.0, "false_occlusions": 4.0, "mean_overlap": 0.5}
        return {}

    sets = set_table(made_scores(fares, [WRITTEN], scenes=2))
    assert len(sets) == 2 * 2 * 2
    clips = sets[sets["sequence"] == CLIPS].set_index(["trace", "scene"])
    for scene in (0, 1):
        assert clips.loc[("revised", scene), ["clips", "tracked", "detected"]].tolist() == [
            20,
            20,
            21,
        ]
        online = clips.loc[("online", scene)]
        assert online[["tracked", "occlusions", "declared", "detected"]].tolist() == [
            19,
            21,
            21,
            20,
        ]
        assert online["tracked_share"] == 0.95
        assert online["detected_share"] == pytest.approx(20 / 21)
        assert online["false_occlusions"] == pytest.approx(0.2)
        assert online["mean_overlap"] == pytest.approx(0.88)
    lights = sets[sets["sequence"] == LIGHTS]
    assert set(lights["clips"]) == {1}
    assert set(lights["detected"]) == {3}


def test_a_set_without_one_of_its_clips_is_none(made_scores):
    scores = made_scores(lambda *_: {}, [WRITTEN, f"{WRITTEN}:features=rgb"], scenes=2)
    broken = (scores["sequence"] == "nguyen2002/clip-07") & (scores["scene"] == 1)
    broken &= scores["features"] == "rgb"
    sets = set_table(scores.assign(failure=np.where(broken, "why", "")))
    clips = sets[sets["sequence"] == CLIPS]
    assert clips.groupby("features")["scene"].unique().map(list).to_dict() == {
        "invariants": [0, 1],
        "rgb": [0],
    }


def test_measured_clips_have_the_name_of_their_set():
    table = pd.DataFrame({"sequence": ["nguyen2002/clip-03", LIGHTS, COLOURED], "x": 1.0})
    found = by_sets({"ng-9": table, "ng-10": pd.DataFrame({"usual": [0.0]})})
    assert found["ng-9"]["sequence"].tolist() == [CLIPS, LIGHTS, COLOURED]
    assert table["sequence"].tolist()[0] == "nguyen2002/clip-03"
    assert list(found["ng-10"]) == ["usual"]
