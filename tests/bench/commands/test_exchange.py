"""Imported and exported results, and metrics in all commands that score."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from tests.bench.commands.conftest import assert_tables_have_rows, json_lines
from trackmark.bench.analysis.published_sets import SETS
from trackmark.bench.store.database import run_key
from trackmark.bench.store.run_store import RunStore

SHARED = Path(__file__).parents[4] / "shared"
PUBLISHED = SHARED / "published"
TWO = "data/Small,data/Other"
pytestmark = pytest.mark.usefixtures("blank_figures")

STATIC = ("run", "--trackers", "static", "--sequences")


@pytest.fixture
def imported(workspace, otb):
    """Write results on two sequences: boxes one pixel to the right of the target."""
    otb(workspace / "data" / "Other", 5)
    (workspace / "imported").mkdir()
    for name in ("Small", "Other", "Unused"):
        (workspace / "imported" / f"{name}.txt").write_text("5,6,10,12\n" + "6,6,10,12\n" * 4)
    return "imported"


def scores(workspace, preset, score, protocol=""):
    with (workspace / "report" / f"{protocol}metrics-{preset}.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["measure"] == score]
    return {(row["tracker"], row["sequence"]): float(row["mean"]) for row in rows}


@pytest.mark.slow
@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="needs published boxes next to the checkout")
@pytest.mark.parametrize("tracker", ["STRUCK", "MEEM", "MUSTer"])
def test_more_published_boxes_give_the_published_overlap(tracker, trackmark, workspace):
    """Check files whose first box shows another first pixel than the others."""
    files = sorted((PUBLISHED / "boxes-more" / tracker).glob("*.json"))
    sequences = ",".join(str(SHARED / "sequences/otb-more" / file.stem) for file in files)
    results = ("--results-of", f"{tracker}={files[0].parent}", "--sequences", sequences)
    trackmark("report", *results, "--metrics", "otb", "--output", "report", "--no-pictures")
    with SETS["otb100"].file.open() as file:
        rows = [row for row in csv.DictReader(file) if row["tracker"] == tracker]
    published = {(tracker, row["sequence"]): float(row["mean_overlap"]) for row in rows}
    overlaps = scores(workspace, "otb", "mean_overlap")
    keys = overlaps.keys() & published.keys()
    assert len(keys) == len(files)
    assert {key: overlaps[key] for key in keys} == pytest.approx(
        {key: published[key] for key in keys}, abs=1e-6
    )


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="needs published boxes next to the checkout")
def test_published_boxes_give_the_published_scores(trackmark, workspace):
    trackers = [f"{name}={PUBLISHED}/boxes/{name}" for name in ("STRUCK", "MEEM", "MUSTer")]
    options = [part for text in trackers for part in ("--results-of", text)]
    where = ("--sequences", f"{SHARED}/sequences/otb/*", "--metrics", "otb")
    trackmark("report", *options, *where, "--output", "report", "--no-pictures")
    overlaps = scores(workspace, "otb", "mean_overlap")
    successes = scores(workspace, "otb", "success_published")
    with (PUBLISHED / "otb-per-sequence.csv").open() as file:
        table = {(row["tracker"], row["sequence"]): row for row in csv.DictReader(file)}
    keys = overlaps.keys() & table.keys()
    assert len(keys) == 9
    for key in keys:
        row = table[key]
        assert overlaps[key] == pytest.approx(float(row["mean_iou_overlapScores"]), abs=1e-6)
        published = float(row["success_at_0.5_from_errorNum"])
        assert successes[key] == pytest.approx(published, abs=1e-6)


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="needs OTB sequences next to the checkout")
def test_own_tracker_is_ranked_among_published_ones(trackmark, workspace):
    sequences = ",".join(f"{SHARED}/sequences/otb/{name}" for name in ("Couple", "Crossing"))
    options = ("--sequences", sequences, "--published", "otb100")
    done = trackmark("compare", "static", *options, "--json")
    answer = json.loads(done.stdout)
    assert answer["metrics"] == "otb"
    means = {row["tracker"]: row["mean"] for row in answer["trackers"]}
    assert len(means) == 35
    assert means["ASLA (published)"] == pytest.approx((0.075859 + 0.784812) / 2, abs=1e-9)
    printed = trackmark("compare", "static", *options).stdout
    assert printed.startswith("static has rank 35 of 35 by mean overlap (otb)")
    assert [line for line in printed.splitlines() if line.startswith("static ")]


@pytest.mark.usefixtures("workspace")
def test_unknown_published_set_is_named(trackmark):
    done = trackmark("compare", "static", "--sequences", "x", "--published", "otb10", status=2)
    assert "neither a CSV file nor one of the published sets: otb100" in done.stderr


def test_report_adds_imported_results_and_stores_nothing(trackmark, workspace, imported):
    trackmark(*STATIC, TWO, "--name", "ours")
    before = sorted(path.name for path in (workspace / "results" / "ours").rglob("*"))
    options = ("--results-of", f"MINE={imported}", "--metrics", "native,otb", "--output", "report")
    done = trackmark("report", "results/ours", *options)
    assert "not requested are not imported: Unused" in done.stderr
    overlaps = scores(workspace, "otb", "mean_overlap")
    assert overlaps["static", "Small"] == 1
    assert overlaps["MINE", "Small"] == pytest.approx((1 + 4 * 9 / 11) / 5)
    assert_tables_have_rows(workspace / "report")
    assert (workspace / "report" / "strip-Small.png").is_file()
    assert sorted(path.name for path in (workspace / "results" / "ours").rglob("*")) == before
    refused = trackmark("report", "results/ours", "--results-of", f"static={imported}", status=2)
    assert "already has runs of static" in refused.stderr


def test_compare_takes_imported_results_by_any_preset(trackmark, imported):
    options = ("--results-of", f"MINE={imported}", "--sequences", TWO, "--metrics", "otb,lasot")
    first, second = json_lines(trackmark("compare", "static", *options, "--json"))
    assert [(data["metrics"], data["measure"]) for data in (first, second)] == [
        ("otb", "success_auc"),
        ("lasot", "success_auc"),
    ]
    assert [row["tracker"] for row in first["trackers"]] == ["static", "MINE"]
    assert first["trackers"][0]["mean"] == pytest.approx(20 / 21)
    alone = trackmark("compare", *options, "--results-of", f"ANOTHER=otb:{imported}")
    assert "MINE - ANOTHER: same boxes on 2 of 2 sequences" in alone.stdout
    results = trackmark("compare", "--results", next(Path("results").iterdir()), *options[:2])
    assert "MINE" in results.stdout


def test_damaged_imported_file_is_one_message(trackmark, workspace, imported, one_line):
    (workspace / imported / "Small.txt").write_text("5,6,10,12\n" * 3)
    report = ("report", "--results-of", f"MINE={imported}", "--sequences", TWO)
    message = one_line(trackmark(*report, status=2))
    assert message.endswith("Small.txt: 3 rows for the 5 frames of Small: ends after line 3.")


def test_exported_results_are_imported_with_equal_scores(trackmark, imported):
    def scores_of(name, path):
        trackmark("results", "import", path, "--sequences", TWO, "--name", name)
        listed = trackmark("results", "list", f"results/{name}", "--json")
        return [row["scores"] for row in json_lines(listed)]

    first = scores_of("first", f"MINE={imported}")
    assert len(first) == 2
    assert np.isfinite([row["mean_overlap"] for row in first]).all()
    for form in ("otb", "otb-json", "got10k", "vot", "pysot", "pytracking"):
        done = trackmark("results", "export", "results/first", form, "--as", form)
        assert done.stderr.startswith(f"{form} contains ")
        assert scores_of(f"from-{form}", f"MINE={form}:{form}/MINE") == first, form


def test_commands_give_scores_by_presets(trackmark):
    run = (*STATIC, "data/Small")
    for _ in range(2):  # the second time the run is stored
        (row,) = json_lines(trackmark(*run, "--json", "--metrics", "otb,vot"))
        assert row["scores"]["mean_overlap"] == 1
        assert row["metrics"]["otb"]["success_auc"] == pytest.approx(20 / 21)
        assert row["metrics"]["vot-supervised"]["eao"] is None  # too short
    assert "metrics" not in json_lines(trackmark(*run, "--json"))[0]
    for command in (run, ("report", "results", "--no-pictures")):
        assert "metrics lasot." in trackmark(*command, "--metrics", "lasot").stdout


def test_exported_times_are_those_of_updates(trackmark, workspace):
    run = (*STATIC, "data/Small", "--name", "ours")
    trackmark(*run)
    stored = RunStore(workspace / "results/ours")
    (row,) = json_lines(trackmark("results", "list", "results/ours", "--json"))
    update = stored.read(run_key(row)).metadata["ms_per_frame"] / 1e3

    def exported(form, name):
        trackmark("results", "export", "results/ours", f"there-{form}", "--as", form, "--force")
        return (workspace / f"there-{form}" / "static" / name).read_text()

    times = exported("got10k", "Small/Small_time.txt").split()
    assert times == ["nan"] + [f"{update:.8f}"] * 4
    (data,) = json.loads(exported("otb-json", "Small.json"))
    assert data["fps"] == pytest.approx(1 / update)


def test_export_refuses_existing_files_and_wrong_selections(trackmark, one_line, workspace):
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small")
    (folder,) = (workspace / "results").iterdir()
    export = ("results", "export", folder, "exported", "--as", "otb")
    existing = workspace / "exported" / "static" / "Small.txt"
    existing.parent.mkdir(parents=True)
    existing.write_text("by hand")
    message = one_line(trackmark(*export, status=2))
    assert "exported/static/Small.txt: the file exists (1 of 2 files do)" in message
    assert "--force" in message
    assert [file for file in (workspace / "exported").rglob("*") if file.is_file()] == [existing]
    assert existing.read_text() == "by hand"
    trackmark(*export, "--force")
    assert existing.read_text().startswith("5")
    assert (workspace / "exported" / "knob.py_Knob" / "Small.txt").is_file()
    assert "Did you mean 'vot'?" in trackmark(*export[:-1], "vott", status=2).stderr
    nothing = trackmark(*export, "--tracker", "x", status=2)
    assert "no finished run by one-pass matches" in nothing.stderr
