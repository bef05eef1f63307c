"""Scores of stored runs by any metrics."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.bench import metrics
from trackmark.bench.analysis.by_metrics import (
    ALL_SEQUENCES,
    LATE,
    MEAN_OF_SEQUENCES,
    MetricScores,
    metric_tables,
)
from trackmark.bench.analysis.run_tables import SUMMARY
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.metrics.interface import RunEstimates
from trackmark.bench.pages.report_figures import metric_curves
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.store.database import run_key
from trackmark.bench.store.runs import Runs
from trackmark.reports.renderers import to_latex, to_markdown, to_text

SEQUENCES = [f"plain/target:length={15 + n}:scene={n}" for n in (0, 1)]


@pytest.fixture(scope="module")
def stored(tmp_path_factory, run_trial):
    folder = run_trial(tmp_path_factory.mktemp("metrics"), ("static", "camshift"), SEQUENCES)
    return Runs.open(folder)


def texts(table):
    """Return the cells of a table by sequence and tracker."""
    return {(row[0].text, row[1].text): [cell.text for cell in row[2:]] for row in table.rows}


@pytest.fixture(scope="module")
def camshift_runs():
    """Provide sequences and runs of a tracker on them."""
    sequences = [datasets.load(text) for text in SEQUENCES]
    return [(sequence, evaluate_run("camshift", sequence)) for sequence in sequences]


@pytest.mark.parametrize("name", metrics.names())
def test_stored_runs_have_scores_of_their_boxes(stored, camshift_runs, name):
    preset = metrics.find_metrics(name)
    scored = MetricScores(stored, name, ONE_PASS, "T")
    means = scored.table.records.set_index(["sequence", "tracker", "measure"])["mean"]
    measures = set(scored.table.records["measure"])
    assert measures == (
        {result.name for result in SUMMARY} if name == "native" else {*preset.metrics}
    )
    judged = []
    for sequence, run in camshift_runs:
        result = preset.score(sequence, RunEstimates(run.boxes, run.visible, run.confidence))
        judged.append([result])
        key = next(key for key in result.scores if key in measures)
        assert means[sequence.name, "camshift", key] == pytest.approx(result.scores[key])
    together = preset.overall(judged)
    for key in measures:
        expected = together.scores.get(key, np.nan)
        printed = means.get((ALL_SEQUENCES, "camshift", key), np.nan)
        assert printed == pytest.approx(expected, nan_ok=True), key
    assert set(scored.curves) == set(preset.curves)


def test_missing_run_makes_its_means_missing(stored):
    missing, *keys = map(run_key, stored.rows)
    (scored,) = metric_tables(stored.select(keys), ["otb"]).with_curves
    assert texts(scored.table)[ALL_SEQUENCES, missing[0]][0] == "— (1 of 2 not run)"
    assert missing[0] not in scored.curves["success"]


def test_tables_follow_the_order_of_presets(stored):
    names = [table.name for table in metric_tables(stored, ["otb", "native", "lasot"]).tables]
    assert names == ["metrics-otb", "summary", "sequences", "metrics-lasot"]
    otb, got10k = metric_tables(stored, ["otb", "got10k"]).tables
    assert "success AUC" in otb.headings
    assert got10k.headings[2:] == ["AO", "SR 0.50", "SR 0.75"]


def test_preset_curves_are_drawn(stored):
    (scored,) = metric_tables(stored, ["vot-anchor"]).with_curves
    names = ["metrics-vot-anchor-eao", "metrics-vot-anchor-accuracy-robustness"]
    assert list(metric_curves(scored, ["static", "camshift"], pytest.fail)) == names
    messages = []
    scored.curves = {name: {} for name in scored.curves}
    assert metric_curves(scored, ["static"], messages.append) == {}
    (message,) = messages
    assert message.endswith("there is no tracker all of whose runs vot-anchor can score.")


@pytest.mark.slow
def test_preset_without_judgeable_runs_has_a_note(run_trial, tmp_path):
    folder = run_trial(tmp_path, ["static"], SEQUENCES, protocol="supervised")
    table = metric_tables(Runs.open(folder), ["otb"]).tables[0]
    assert not table.rows
    for text in (to_text(table), to_markdown(table), to_latex(table)):
        assert "otb cannot score runs of the protocol supervised" in text
        assert "toprule" not in text
        assert "---" not in text
    assert set(table.records["lacking"]) == {"1 of 1 not scored", "2 of 2 not scored"}


@pytest.mark.slow
@pytest.mark.parametrize(("seconds", "late"), [(0.02, 0.0), (0.05, 1.0)])
def test_late_estimates_are_counted_in_real_time(run_trial, tmp_path, seconds, late):
    protocol = f"real-time:update_seconds={seconds}"
    folder = run_trial(tmp_path, ["static"], SEQUENCES, protocol=protocol)
    (table,) = metric_tables(Runs.open(folder), ["native"]).tables
    late_rows = table.records[table.records["measure"] == LATE.name]
    assert set(late_rows["sequence"]) > {ALL_SEQUENCES}
    assert late_rows["mean"].tolist() == [late] * 3
    assert table.headings[-1] == "late estimates [%]"
    counted = late_rows.set_index("sequence")["runs"]
    assert counted[ALL_SEQUENCES] == 2
    assert set(counted.drop(ALL_SEQUENCES)) == {1}


def test_scores_with_one_value_per_unit_have_intervals(run_trial, tmp_path):
    names = [f"plain/target:length=120:width=64:height=64:scene={n}" for n in range(6)]
    folder = run_trial(tmp_path, ["static"], names)
    otb, vot = metric_tables(Runs.open(folder), ["otb", "vot-anchor"]).with_curves
    assert all("[" in cell for cell in texts(otb.table)[ALL_SEQUENCES, "static"])
    assert "95 % interval of the mean for new scenes of this sequence only" in otb.table.caption
    columns = vot.table.headings[2:]
    whole = dict(zip(columns, texts(vot.table)[ALL_SEQUENCES, "static"], strict=True))
    means = dict(zip(columns, texts(vot.table)[MEAN_OF_SEQUENCES, "static"], strict=True))
    assert whole["accuracy"].endswith(" –")
    assert "[" in means["accuracy"]
    assert whole["EAO"].endswith(" –")
    assert means["EAO"] == "—"


@pytest.mark.parametrize(("protocol", "preset"), [("real-time", "native"), ("one-pass", "got10k")])
def test_means_skip_sequences_with_an_undefined_score(run_trial, tmp_path, otb, protocol, preset):
    names = [str(otb(tmp_path / f"s{n}", n)) for n in (1, 4, 5, 6, 7, 8, 9)]  # frames
    folder = run_trial(tmp_path, ["static"], names, protocol=protocol)
    (table,) = metric_tables(Runs.open(folder), [preset]).tables
    cells = texts(table)
    label = ALL_SEQUENCES if preset == "native" else MEAN_OF_SEQUENCES
    assert cells["s1", "static"][0] == "—"
    assert cells[label, "static"][0] == "1.000 [1.000, 1.000]"
    omitted, reason = table.notes
    assert omitted == "—: undefined in a run; the mean over all sequences omits this run"
    assert reason == f"—: {metrics.find_metrics(preset).undefined}: s1"
