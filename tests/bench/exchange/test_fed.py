"""Others' tools read what we export, and give the numbers that we give; see `fed`."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.bench.exchange import fed
from trackmark.bench import metrics
from trackmark.bench.evaluation.scoring import judge
from trackmark.bench.metrics.preset import Answer
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth


def told(tool):
    return json.loads((fed.HERE / f"fed_{tool}.json").read_text())


def close(scores):
    return {name: pytest.approx(value, abs=1e-9, rel=0) for name, value in scores.items()}


def judged(folder, preset, origin=None):
    """Stored runs by sequence, judged; by numbers that count from an origin, where one is given."""
    runs, results = {}, Results(folder)
    for path in sorted(results.cells()):
        run = results.read(path)
        key = run.identity
        truth = read_truth(folder, key.sequence, key.fingerprint)
        one = judge(run, truth, preset)
        if origin is not None:
            shift = np.array([origin, origin, 0, 0])
            shifted = replace(truth, boxes=truth.boxes + shift)
            one = metrics.preset(preset).judge(shifted, Answer(run.boxes + shift))
        runs.setdefault(key.sequence, []).append(one)
    return runs


def scores(runs, preset, names):
    """Of all sequences together."""
    found = metrics.preset(preset).overall(list(runs.values())).scores
    return {name: found[name] for name in names}


@pytest.fixture
def exported(trackmark, tmp_path):
    """Folder with the copies, and our results in the tools' layouts."""
    fed.copies(tmp_path, fed.picture())
    fed.export(tmp_path, trackmark)
    return tmp_path


OURS = {  # by got10k's experiment the layout's folder, and our names of its scores
    "got10k": ("results/GOT-10k", {"ao": "ao", "sr50": "sr"}),
    "otb": ("results/OTBmade", {"success_auc": "success_score", "precision": "precision_score"}),
}


def test_they_read_our_files_and_give_our_numbers(exported):
    for name, (where, named) in OURS.items():
        theirs = told("got10k")[name]
        files = fed.digest(exported / where / fed.TRACKER)
        assert files == theirs["files"], "recorded of other files: record anew"
        runs = judged(exported / "stored" / name, name, origin=1)
        assert set(runs) == set(theirs["seq_wise"])
        asked = {key: {key: of} for key, of in runs.items()} | {"": runs}
        for key, of in asked.items():
            said = theirs["seq_wise"][key] if key else theirs["overall"]
            expected = close({ours: said[other] for ours, other in named.items()})
            assert scores(of, name, named) == expected, key

    # Ours count from 0, and so does the image: its border is not where got10k cuts boxes off.
    ours = scores(judged(exported / "stored" / "got10k", "got10k"), "got10k", ["ao"])["ao"]
    assert 1e-9 < abs(ours - told("got10k")["got10k"]["overall"]["ao"]) < 1e-3

    theirs = told("vot")
    files = fed.digest(exported / "vot" / "results" / fed.TRACKER)
    assert files == theirs["files"], "recorded of other files: record anew"
    runs = judged(exported / "stored" / "baseline", "vot-supervised")
    baseline = theirs["baseline"]
    assert scores(runs, "vot-supervised", baseline) == close(baseline)
    (eao,) = scores(runs, "vot-supervised", ["eao"]).values()
    assert eao == pytest.approx(theirs["eao"], abs=1e-6)  # theirs in single precision
    runs = judged(exported / "stored" / "longterm", "long-term")
    assert scores(runs, "long-term", theirs["longterm"]) == close(theirs["longterm"])
