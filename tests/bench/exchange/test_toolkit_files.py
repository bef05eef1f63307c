"""Scores that toolkits compute from exported files against our scores; see `toolkit_files`."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.bench.exchange import toolkit_files
from trackmark.bench import metrics
from trackmark.bench.evaluation.scoring import score_run
from trackmark.bench.metrics.interface import RunEstimates
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.truth import read_truth


def read_recorded(tool):
    return json.loads((toolkit_files.HERE / f"toolkit_files_{tool}.json").read_text())


def approximately(scores):
    return {name: pytest.approx(value, abs=1e-9, rel=0) for name, value in scores.items()}


def judge_runs(folder, preset, origin=None):
    """Judge stored runs by sequence, with pixels counted from `origin` if it is given."""
    runs, results = {}, RunStore(folder)
    for path in sorted(results.list_keys()):
        run = results.read(path)
        key = run.identity
        truth = read_truth(folder, key.sequence, key.fingerprint)
        judgement = score_run(run, truth, preset)
        if origin is not None:
            shift = np.array([origin, origin, 0, 0])
            shifted = replace(truth, boxes=truth.boxes + shift)
            judgement = metrics.find_metrics(preset).score(shifted, RunEstimates(run.boxes + shift))
        runs.setdefault(key.sequence, []).append(judgement)
    return runs


def scores(runs, preset, names):
    """Return scores over all sequences."""
    overall = metrics.find_metrics(preset).overall(list(runs.values())).scores
    return {name: overall[name] for name in names}


@pytest.fixture
def exported(trackmark, tmp_path):
    """Provide a folder with the data sets and our results in the formats of the toolkits."""
    toolkit_files.write_data_sets(tmp_path, toolkit_files.picture())
    toolkit_files.export(tmp_path, trackmark)
    return tmp_path


OURS = {  # folder of results and our names of the scores, by experiment of got10k
    "got10k": ("results/GOT-10k", {"ao": "ao", "sr50": "sr"}),
    "otb": ("results/OTBmade", {"success_auc": "success_score", "precision": "precision_score"}),
}


def test_toolkits_compute_our_scores_from_exported_files(exported):
    for name, (where, named) in OURS.items():
        theirs = read_recorded("got10k")[name]
        files = toolkit_files.digest(exported / where / toolkit_files.TRACKER)
        assert files == theirs["files"], "recorded for other files: record the scores again"
        runs = judge_runs(exported / "stored" / name, name, origin=1)
        assert set(runs) == set(theirs["seq_wise"])
        subsets = {key: {key: judged} for key, judged in runs.items()} | {"": runs}
        for key, subset in subsets.items():
            recorded = theirs["seq_wise"][key] if key else theirs["overall"]
            expected = approximately({ours: recorded[other] for ours, other in named.items()})
            assert scores(subset, name, named) == expected, key

    # We count pixels from 0. got10k clips boxes at a border that is one pixel further right.
    ours = scores(judge_runs(exported / "stored" / "got10k", "got10k"), "got10k", ["ao"])["ao"]
    assert 1e-9 < abs(ours - read_recorded("got10k")["got10k"]["overall"]["ao"]) < 1e-3

    theirs = read_recorded("vot")
    files = toolkit_files.digest(exported / "vot" / "results" / toolkit_files.TRACKER)
    assert files == theirs["files"], "recorded for other files: record the scores again"
    runs = judge_runs(exported / "stored" / "baseline", "vot-supervised")
    baseline = theirs["baseline"]
    assert scores(runs, "vot-supervised", baseline) == approximately(baseline)
    (eao,) = scores(runs, "vot-supervised", ["eao"]).values()
    assert eao == pytest.approx(theirs["eao"], abs=1e-6)  # theirs in single precision
    runs = judge_runs(exported / "stored" / "longterm", "long-term")
    assert scores(runs, "long-term", theirs["longterm"]) == approximately(theirs["longterm"])
