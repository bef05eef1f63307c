"""Stored runs scored by any metrics preset, without being run again."""

from dataclasses import replace

import numpy as np
import pytest

from trackmark import bench, datasets
from trackmark.bench import metrics
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.metrics.preset import Answer
from trackmark.bench.reporting.by_preset import (
    LATE,
    MEANS,
    TOGETHER,
    by_presets,
    tables_by,
    write_curves,
)
from trackmark.bench.reporting.tables import SUMMARY
from trackmark.bench.store.loading import load_results
from trackmark.bench.store.truth import read_truth
from trackmark.reports.renderers import to_latex, to_markdown, to_text

SOURCES = tuple(SequenceSource(f"plain/target:length={15 + n}:scene={n}") for n in (0, 1))


@pytest.fixture(scope="module")
def stored(tmp_path_factory, without_processes):
    with without_processes():
        folder = tmp_path_factory.mktemp("presets")
        return bench.run(Experiment("trial", ("static", "camshift"), SOURCES), folder, jobs=1)


def texts(table):
    """Cells of a table by sequence and tracker."""
    return {(row[0].text, row[1].text): [cell.text for cell in row[2:]] for row in table.rows}


@pytest.mark.parametrize("name", metrics.names())
def test_a_stored_run_scores_what_its_boxes_do_together_as_the_preset_says(stored, name):
    preset = metrics.preset(name)
    (scored,) = by_presets(stored, [name])
    found = scored.table.data.set_index(["sequence", "tracker", "measure"])["mean"]
    told = set(scored.table.data["measure"])
    assert told == ({one.name for one in SUMMARY} if name == "native" else {*preset.columns})
    judged = []
    for source in SOURCES:
        sequence = datasets.load(source.text)
        run = bench.evaluate("camshift", sequence)
        one = preset.judge(sequence, Answer(run.boxes, run.visible, run.confidence))
        judged.append([one])
        key = next(key for key in one.scores if key in told)
        assert found[sequence.name, "camshift", key] == pytest.approx(one.scores[key])
    together = preset.overall(judged)
    for key in told:
        value = together.scores.get(key, np.nan)
        shown = found.get((TOGETHER, "camshift", key), np.nan)
        assert shown == pytest.approx(value, nan_ok=True), key
    assert set(scored.curves) == set(preset.curves)


def test_stored_truth_knows_the_images_size(stored):
    runs = load_results(stored)
    truth = read_truth(stored, runs["sequence"][0], runs["fingerprint"][0])
    assert truth.image_size == datasets.load(SOURCES[0].text).image_size


def test_a_run_that_lacks_makes_what_it_belongs_to_missing(stored):
    rows = load_results(stored).itertuples()
    names = [(row.tracker, row.sequence, row.repetition, row.protocol) for row in rows]
    (scored,) = by_presets(stored, ["otb"], cells=names[1:])
    assert texts(scored.table)[TOGETHER, names[0][0]][0] == "— (1 of 2 not run)"
    assert names[0][0] not in scored.curves["success"]


def test_a_preset_says_why_it_does_not_judge_a_run(stored):
    (scored,) = by_presets(stored, ["vot-supervised"])
    refused = [note for note in scored.table.notes if note.startswith("not scored: vot-supervised")]
    lost = [row for row in texts(scored.table).values() if "not scored" in row[0]]
    assert bool(refused) == bool(lost)


def test_several_presets_give_a_table_each_and_native_its_own(stored, tmp_path):
    made = [table.name for table in tables_by(stored, ["native", "otb", "lasot"])]
    assert made == ["summary", "sequences", "metrics-otb", "metrics-lasot"]
    scored = by_presets(stored, ["vot-anchor"])
    paths = write_curves(tmp_path, scored, ["static", "camshift"], pytest.fail)
    assert [path.name for path in paths] == [
        "metrics-vot-anchor-eao.png",
        "metrics-vot-anchor-accuracy-robustness.png",
    ]


def test_without_a_tracker_whose_runs_can_all_be_judged_there_is_no_plot_but_a_word(
    stored, tmp_path
):
    runs = list(load_results(stored).itertuples())[:1]
    cells = [(row.tracker, row.sequence, row.repetition, row.protocol) for row in runs]
    scored, said = by_presets(stored, ["otb"], cells=cells), []
    scored = [replace(one, curves={name: {} for name in one.curves}) for one in scored]
    assert write_curves(tmp_path, scored, ["static"], said.append) == []
    assert said == ["metrics-otb: no plot: there is no tracker all of whose runs otb can judge."]
    assert not list(tmp_path.iterdir())


def test_what_a_preset_can_judge_no_run_of_is_said_in_a_sentence(without_processes, tmp_path):
    with without_processes():
        asked = Experiment("trial", ("static",), SOURCES, protocol="supervised")
        folder = bench.run(asked, tmp_path, jobs=1)
    table = tables_by(folder, ["otb"])[0]
    assert not table.rows
    for text in (to_text(table), to_markdown(table), to_latex(table)):
        assert "otb judges no runs by the protocol supervised" in text
        assert "toprule" not in text
        assert "---" not in text
    assert set(table.data["lacking"]) == {"1 of 1 not scored", "2 of 2 not scored"}


@pytest.mark.parametrize(("seconds", "late"), [(0.0, 0.0), (0.05, 1.0), (0.02, 0.0)])
def test_late_answers_are_counted_in_real_time(without_processes, tmp_path, seconds, late):
    with without_processes():
        protocol = f"real-time:seconds={seconds}"
        asked = Experiment("trial", ("static",), SOURCES, protocol=protocol)
        folder = bench.run(asked, tmp_path, jobs=1)
    (table,) = tables_by(folder, ["native"])
    told = table.data[table.data["measure"] == LATE.name]
    assert set(told["sequence"]) > {TOGETHER}
    assert told["mean"].tolist() == [late] * 3
    assert table.heads[-1] == "late answers [%]"
    counted = told.set_index("sequence")["runs"]
    assert counted[TOGETHER] == 2
    assert set(counted.drop(TOGETHER)) == {1}


def test_presets_come_in_the_order_that_they_are_asked_for_in(stored):
    names = [table.name for table in tables_by(stored, ["otb", "native", "lasot"])]
    assert names == ["metrics-otb", "summary", "sequences", "metrics-lasot"]
    assert [one.name for one in tables_by(stored, ["native", "otb"])][-1] == "metrics-otb"


def test_scores_have_the_names_that_papers_give_them(stored):
    otb, got10k = tables_by(stored, ["otb", "got10k"])
    assert "success AUC" in otb.heads
    assert got10k.heads[2:] == ["AO", "SR 0.50", "SR 0.75"]


def test_scores_with_one_value_per_unit_have_intervals(without_processes, tmp_path):
    sources = tuple(
        SequenceSource(f"plain/target:length=120:width=64:height=64:scene={n}") for n in range(6)
    )
    with without_processes():
        folder = bench.run(Experiment("six", ("static",), sources), tmp_path, jobs=1)
    otb, vot = by_presets(folder, ["otb", "vot-anchor"])
    assert all("[" in cell for cell in texts(otb.table)[TOGETHER, "static"])
    assert "95 % interval of the mean for new scenes of this family only" in otb.table.caption
    columns = vot.table.heads[2:]
    whole = dict(zip(columns, texts(vot.table)[TOGETHER, "static"], strict=True))
    means = dict(zip(columns, texts(vot.table)[MEANS, "static"], strict=True))
    assert whole["accuracy"].endswith(" –")
    assert "[" in means["accuracy"]
    assert whole["EAO"].endswith(" –")
    assert means["EAO"] == "—"


@pytest.mark.parametrize(("protocol", "preset"), [("real-time", "native"), ("", "got10k")])
def test_means_skip_sequences_with_an_undefined_score(
    without_processes, tmp_path, otb, protocol, preset
):
    folders = [otb(tmp_path / f"s{n}", n) for n in (1, 4, 5, 6, 7, 8, 9)]  # frames
    sources = tuple(SequenceSource(str(folder)) for folder in folders)
    with without_processes():
        asked = Experiment("trial", ("static",), sources, protocol=protocol or "one-pass")
        folder = bench.run(asked, tmp_path, jobs=1)
    (table,) = tables_by(folder, [preset])
    shown = texts(table)
    label = TOGETHER if preset == "native" else MEANS
    assert shown["s1", "static"][0] == "—"
    assert shown[label, "static"][0] == "1.000 [1.000, 1.000]"
    assert table.notes == ["—: undefined in a run, which the mean over all sequences leaves out"]
