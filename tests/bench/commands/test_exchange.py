"""Others' results beside ours, ours for others' tools, and presets in all commands that score."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from trackmark.bench.store.layout import cell_of
from trackmark.bench.store.results import Results

SHARED = Path(__file__).parents[4] / "shared"
PUBLISHED = SHARED / "published"
TWO = "data/Small,data/Other"


@pytest.fixture
def theirs(here, otb):
    """Results of somebody on two sequences: boxes a pixel to the right of where the target is."""
    otb(here / "data" / "Other", 5)
    (here / "theirs").mkdir()
    for name in ("Small", "Other", "Unasked"):
        (here / "theirs" / f"{name}.txt").write_text("5,6,10,12\n" + "6,6,10,12\n" * 4)
    return "theirs"


def scores(here, preset, score, protocol=""):
    with (here / "report" / f"{protocol}metrics-{preset}.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["measure"] == score]
    return {(row["tracker"], row["sequence"]): float(row["mean"]) for row in rows}


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="published boxes lie beside the project alone")
def test_published_boxes_give_the_published_scores(trackmark, here):
    given = [f"{name}={PUBLISHED}/boxes/{name}" for name in ("STRUCK", "MEEM", "MUSTer")]
    options = [part for text in given for part in ("--results-of", text)]
    where = ("--sequences", f"{SHARED}/sequences/otb/*", "--metrics", "otb")
    trackmark("report", *options, *where, "--folder", "report", "--no-pictures")
    overlaps = scores(here, "otb", "mean_overlap")
    successes = scores(here, "otb", "success_published")
    with (PUBLISHED / "otb-per-sequence.csv").open() as file:
        rows = [
            row for row in csv.DictReader(file) if (row["tracker"], row["sequence"]) in overlaps
        ]
    assert len(rows) == 9
    for row in rows:
        key = row["tracker"], row["sequence"]
        assert overlaps[key] == pytest.approx(float(row["mean_iou_overlapScores"]), abs=1e-6)
        published = float(row["success_at_0.5_from_errorNum"])
        assert successes[key] == pytest.approx(published, abs=1e-6)


def test_others_results_stand_in_the_tables_of_ours_and_change_nothing_there(
    trackmark, here, theirs
):
    trackmark("run", "--trackers", "static", "--sequences", TWO, "--name", "ours")
    before = sorted(path.name for path in (here / "results" / "ours").rglob("*"))
    asked = ("--results-of", f"SOMEBODY={theirs}", "--metrics", "native,otb", "--folder", "report")
    said = trackmark("report", "results/ours", *asked)
    assert "not asked for: Unasked" in said.stderr
    overlaps = scores(here, "otb", "mean_overlap")
    assert overlaps["static", "Small"] == 1
    assert overlaps["SOMEBODY", "Small"] == pytest.approx((1 + 4 * 9 / 11) / 5)
    assert (here / "report" / "strip-Small.png").is_file()
    assert sorted(path.name for path in (here / "results" / "ours").rglob("*")) == before
    taken = trackmark("report", "results/ours", "--results-of", f"static={theirs}", status=2)
    assert "has runs of static already" in taken.stderr


def test_trackers_are_compared_with_others_by_any_preset(trackmark, theirs):
    others = ("--results-of", f"SOMEBODY={theirs}", "--sequences", TWO, "--metrics", "otb,lasot")
    said = trackmark("compare", "static", *others, "--json").stdout.splitlines()
    told = [json.loads(line) for line in said]
    assert [(one["metrics"], one["measure"]) for one in told] == [
        ("otb", "success_auc"),
        ("lasot", "success_auc"),
    ]
    assert [row["tracker"] for row in told[0]["trackers"]] == ["static", "SOMEBODY"]
    assert told[0]["trackers"][0]["mean"] == pytest.approx(20 / 21)
    alone = trackmark("compare", *others, "--results-of", f"ANOTHER=otb:{theirs}")
    assert "SOMEBODY - ANOTHER: same boxes on 2 of 2 sequences" in alone.stdout
    results = trackmark("compare", "--results", next(Path("results").iterdir()), *others[:2])
    assert "SOMEBODY" in results.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--metric", "nonsense"), "is not one of mean_overlap"),
        (("--metrics", "otb", "--metric", "centre_error"), "otb has no 'centre_error'"),
        (("--metrics", "vot", "--metric", "failures"), "--margin"),
        (("--results-of", "SOMEBODY=theirs"), "names SOMEBODY twice"),
    ],
)
def test_what_cannot_be_compared_is_a_line(trackmark, theirs, options, words):
    others = ("--results-of", f"SOMEBODY={theirs}", "--sequences", TWO)
    assert words in trackmark("compare", "static", *others, *options, status=2).stderr


@pytest.mark.parametrize("arguments", [(), ("--results-of", "A=theirs"), ("--sequences", TWO)])
def test_a_report_needs_something_to_report_on(trackmark, theirs, arguments):
    assert "Give RESULTS" in trackmark("report", *arguments, status=2).stderr


def test_a_damaged_file_of_others_is_one_line(trackmark, here, theirs, one_line):
    (here / theirs / "Small.txt").write_text("5,6,10,12\n" * 4)
    asked = ("report", "--results-of", f"SOMEBODY={theirs}", "--sequences", TWO)
    said = one_line(trackmark(*asked, status=2))
    assert said.endswith("Small.txt: 4 rows for the 5 frames of Small: ends after line 4.")


@pytest.mark.parametrize("layout", ["otb", "otb-json", "got10k", "vot", "pysot", "pytracking"])
def test_what_is_exported_is_imported_with_the_same_scores(trackmark, here, theirs, layout):
    trackmark("results", "import", f"SOMEBODY={theirs}", "--sequences", TWO, "--name", "first")
    said = trackmark("results", "export", "results/first", "there", "--as", layout)
    assert said.stderr.startswith(f"{layout} keeps ")
    again = f"SOMEBODY={layout}:there/SOMEBODY"
    trackmark("results", "import", again, "--sequences", TWO, "--name", "second")
    first, second = (
        [
            json.loads(line)
            for line in trackmark(
                "results", "list", f"results/{name}", "--json"
            ).stdout.splitlines()
        ]
        for name in ("first", "second")
    )
    assert len(first) == 2
    assert [row["scores"] for row in first] == [row["scores"] for row in second]
    assert np.isfinite([row["scores"]["mean_overlap"] for row in first]).all()


def test_an_unknown_layout_and_nothing_to_export_are_told(trackmark, theirs):
    trackmark("results", "import", f"SOMEBODY={theirs}", "--sequences", TWO)
    asked = ("results", "export", "results/published", "there")
    assert "Did you mean 'vot'?" in trackmark(*asked, "--as", "vott", status=2).stderr
    nothing = trackmark(*asked, "--as", "vot", "--tracker", "x", status=2)
    assert "no finished run by one-pass matches" in nothing.stderr


def test_runs_that_were_begun_again_are_judged_by_presets_of_that_protocol_alone(
    trackmark, here, otb
):
    otb(here / "data" / "Other", 12)
    file = here / "theirs" / "baseline" / "Other" / "Other_001.txt"
    file.parent.mkdir(parents=True)
    rows = ["1", "4,5,10,12", "2", *["0"] * 4, "1", *["4,5,10,12"] * 4]
    file.write_text("".join(f"{row}\n" for row in rows))
    asked = ("report", "--results-of", "SOMEBODY=theirs", "--sequences", "data/Other")
    said = trackmark(*asked, "--metrics", "native,vot,otb", "--folder", "report", "--no-pictures")
    assert scores(here, "vot-supervised", "failures", "supervised-") == {("SOMEBODY", "Other"): 1}
    assert "otb judges no runs by the protocol supervised" in said.stdout
    assert "nan" not in said.stdout


def test_run_gives_scores_of_presets_as_json(trackmark):
    asked = ("run", "--trackers", "static", "--sequences", "data/Small", "--json")
    for _ in range(2):  # run, and there already
        (line,) = trackmark(*asked, "--metrics", "otb,vot").stdout.splitlines()
        told = json.loads(line)
        assert told["scores"]["mean_overlap"] == 1
        assert told["metrics"]["otb"]["success_auc"] == pytest.approx(20 / 21)
        assert told["metrics"]["vot-supervised"]["eao"] is None  # too short
    assert "metrics" not in json.loads(trackmark(*asked).stdout)


def test_check_shows_scores_by_other_presets(trackmark):
    trackmark("baseline", "mine", "--trackers", "static", "--sequences", "data/Small")
    assert "metrics preset otb." in trackmark("check", "mine", "--metrics", "otb").stdout
    assert "metrics preset" not in trackmark("check", "mine").stdout


def test_exported_times_are_those_of_updates(trackmark, here):
    asked = ("run", "--trackers", "static", "--sequences", "data/Small", "--name", "ours")
    trackmark(*asked)
    (row,) = map(
        json.loads, trackmark("results", "list", "results/ours", "--json").stdout.split("\n")[:1]
    )
    update = Results(here / "results/ours").read(cell_of(row))
    update = update.circumstances["update_seconds"]

    def exported(kind, name):
        trackmark("results", "export", "results/ours", f"there-{kind}", "--as", kind, "--force")
        return (here / f"there-{kind}" / "static" / name).read_text()

    times = exported("got10k", "Small/Small_time.txt").split()
    assert times == ["nan"] + [f"{update:.8f}"] * 4
    (told,) = json.loads(exported("otb-json", "Small.json"))
    assert told["fps"] == pytest.approx(1 / update)
    trackmark(*asked, "--timing")
    timed = np.array(exported("got10k", "Small/Small_time.txt").split(), float)
    known = Results(here / "results/ours").read(("static", "Small", 0, "timing")).times
    expected = [known.initialisation_wall, *known.wall[1:]]
    np.testing.assert_allclose(timed, expected, rtol=0, atol=1e-8)


def test_export_refuses_existing_files_without_force(trackmark, one_line, tmp_path):
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small")
    (folder,) = (tmp_path / "results").iterdir()
    export = ("results", "export", folder, "exported", "--as", "otb")
    existing = tmp_path / "exported" / "static" / "Small.txt"
    existing.parent.mkdir(parents=True)
    existing.write_text("by hand")
    message = one_line(trackmark(*export, status=2))
    assert "exported/static/Small.txt: the file exists (1 of 2 files do)" in message
    assert "--force" in message
    assert [file for file in (tmp_path / "exported").rglob("*") if file.is_file()] == [existing]
    assert existing.read_text() == "by hand"
    trackmark(*export, "--force")
    assert existing.read_text().startswith("5")
    assert (tmp_path / "exported" / "knob.py_Knob" / "Small.txt").is_file()
