"""Tests of the command `trackmark compare`."""

import json

import pytest

from tests.bench.commands.conftest import SMALL, TINY, assert_tables_have_rows, unwrapped
from trackmark.bench.experiments import tracker_spec
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs

pytestmark = pytest.mark.usefixtures("blank_figures")

SIX_SCENES = ",".join(f"{TINY}:scene={scene}" for scene in range(6))
SCENES = ",".join(SIX_SCENES.split(",")[:2])


def test_compare_runs_missing_runs_and_writes_files(trackmark, workspace):
    names = ("static", "camshift", "knob.py:Knob")
    done = trackmark("compare", *names, "--sequences", SIX_SCENES, "--output", "paper")
    printed = done.stdout
    (results,) = (workspace / "results").iterdir()
    assert f"Runs are in results/{results.name}." in done.stderr.splitlines()
    assert "6 scenes, 1 run each; 95 % intervals for new scenes of this" in unwrapped(printed)
    assert "differences, first minus second; the 3 intervals hold together at 95 %" in printed
    assert printed.startswith("No clear winner: camshift 0.25, ")
    assert max(map(len, printed.splitlines())) <= 80
    assert len(printed.splitlines()) <= 20
    quiet = trackmark("compare", *names, "--sequences", SIX_SCENES, "--quiet")
    assert printed.startswith(unwrapped(quiet.stdout)[:75])
    assert quiet.stderr == ""
    assert_tables_have_rows(workspace / "paper")
    assert (workspace / "paper" / "comparison.tex").is_file()
    assert (workspace / "paper" / "differences.png").is_file()
    assert "camshift" in (workspace / "paper" / "paragraph.txt").read_text()
    data = json.loads(trackmark("compare", "--results", results, "--json").stdout)
    assert [row["tracker"] for row in data["trackers"]] == ["static", "camshift", "knob.py:Knob"]
    assert (data["unit"], data["comparisons"], data["subsets"]) == ("scene", 3, [])
    for options in (("camshift", "--against", "static"), ("static", "camshift")):
        two = trackmark("compare", "--results", results, *options, "--json").stdout
        (pair,) = json.loads(two)["pairs"]
        assert (pair["first"], pair["second"]) == ("static", "camshift")


@pytest.mark.slow
def test_pair_is_the_same_without_a_tracker_that_is_not_named(trackmark, workspace):
    where = ("--sequences", SIX_SCENES, "--name", "stored")
    pair = ("compare", "static", "camshift", "--json")
    alone = trackmark(*pair, *where).stdout
    trackmark("run", "--trackers", "knob.py:Knob", *where, "--repetitions", 2)
    stored = (*pair, "--results", "results/stored")
    assert trackmark(*pair, *where).stdout == trackmark(*stored).stdout == alone
    with (workspace / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    assert trackmark(*stored).stdout == alone


@pytest.mark.slow
def test_single_sequence_has_a_difference_without_interval(trackmark):
    printed = trackmark("compare", "static", "camshift", "--sequences", TINY).stdout
    assert "1 sequence: too few for intervals (6 needed)" in printed
    assert "Differences of mean overlap by sequence" in printed


@pytest.mark.slow
def test_failed_runs_are_counted_and_named(trackmark, workspace, otb):
    otb(workspace / "data" / "Long", 9)
    late = "self.n = getattr(self, 'n', 0) + 1\n        if self.n > LATE: raise ValueError('lost')"
    update = "return Estimate(self.box + [self.random.random(), 0, 0, 0])"
    text = (workspace / "knob.py").read_text()
    # Sources of different lengths: Python's bytecode cache compares sizes and whole seconds.
    for limit, status in ((6, 0), (1.5, 1)):
        body = f"{late.replace('LATE', str(limit))}\n        {update}"
        (workspace / "knob.py").write_text(text.replace(update, body))
        where = ("--sequences", "data/Small,data/Long", "--name", f"limit{limit}")
        run = trackmark("compare", "static", "knob.py:Knob", *where, status=status)
        treatment = "counted as 0" if status == 0 else "left out"
        note = f"knob.py:Knob: {1 + status} of 2 runs failed ({treatment}): sequence"
        assert note in run.stderr
        assert note in unwrapped(run.stdout)
        results = ("--results", f"results/limit{limit}")
        trackers = json.loads(trackmark("compare", *results, "--json", status=status).stdout)
        assert len(trackers["trackers"]) == 2 - status


@pytest.mark.slow
def test_missing_run_is_executed_or_refused_in_results(trackmark, workspace):
    trackmark("compare", "static", "camshift", "--sequences", SCENES, "--name", "gap")
    results = RunStore(workspace / "results/gap")
    requested = Runs.unscored(results.folder).requested
    results.remove([next(key for key in results.list_keys() if key[0] == "camshift")])
    results.add_requests(requested)
    results = ("compare", "--results", "results/gap")
    message = trackmark(*results, status=2).stderr
    assert "tracker camshift, sequence plain/target:height=64:length=12" in message
    assert "the run is missing" in message
    trackmark("compare", "static", "camshift", "--sequences", SCENES, "--name", "gap")
    trackmark(*results)


@pytest.mark.slow
def test_other_boxes_in_timing_run_are_not_repeatable(trackmark, workspace):
    text = (workspace / "knob.py").read_text()
    (workspace / "knob.py").write_text(text.replace("default_rng(self.seed)", "default_rng()"))
    where = ("static", "knob.py:Knob", *SMALL, "--name", "timed")
    assert "not repeatable" not in trackmark("compare", *where).stdout
    run = ("run", "--trackers", "static,knob.py:Knob", *where[2:], "--timing")
    trackmark(*run)
    printed = trackmark("compare", *where).stdout
    assert "knob.py:Knob (not repeatable)" in printed
    assert "static (not repeatable)" not in printed


SHIFT_TRACKERS = """
from trackmark.trackers.base.interface import Estimate, TrackerPlugin
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs

class Left(TrackerPlugin):
    shift = -1

    def init(self, image, box, mask=None):
        self.box, self.mean = box, image.mean()

    def update(self, image):
        # In data/Small and data/Still all images are equal.
        return Estimate(self.box + [self.shift * (image.mean() != self.mean), 0, 0, 0])

class Right(Left):
    shift = 1
"""


def test_sequences_with_the_same_boxes_are_counted(trackmark, workspace, otb):
    for name in ("Moving", "Short", "Still"):
        otb(workspace / "data" / name, 4)
    for name in ("Small", "Still"):
        for image in (workspace / "data" / name / "img").iterdir():
            image.write_bytes((workspace / "data/Small/img/0001.png").read_bytes())
    truth = workspace / "data" / "Moving" / "groundtruth_rect.txt"
    truth.write_text("".join(f"{5 + frame},6,10,12\n" for frame in range(4)))
    (workspace / "shift.py").write_text(SHIFT_TRACKERS)
    trackers = ("shift.py:Left", "shift.py:Right")
    where = ("--sequences", "data/Small,data/Moving,data/Short,data/Still", "--name", "stored")
    assert "same boxes on 2 of 4 sequences" in trackmark("compare", *trackers, *where).stdout
    stored = trackmark("compare", "--results", "results/stored", "--json").stdout
    (pair,) = json.loads(stored)["pairs"]
    assert pair["same_boxes"] == 2
    # In data/Short different boxes have equal scores.
    differing = [abs(difference) > 0.01 for difference in pair["differences"]]
    assert differing == [False, True, False, False]


@pytest.mark.slow
def test_differently_averaged_score_is_named_mean_of_sequences(trackmark, workspace):
    compare = ("compare", "static", "camshift", "--sequences", SCENES, "--metrics")
    printed = trackmark(*compare, "got10k", "--output", "paper").stdout
    title = "mean of sequences' AO (got10k)"
    assert title in unwrapped(printed)
    assert title in (workspace / "paper/paragraph.txt").read_text()
    assert json.loads(trackmark(*compare, "got10k", "--json").stdout)["title"] == title
    assert json.loads(trackmark(*compare, "otb", "--json").stdout)["title"] == "success AUC (otb)"


@pytest.mark.slow
def test_preset_that_refuses_runs_prevents_all_output(trackmark):
    longer = SCENES.replace("length=12", "length=40")  # long enough that a tracker fails
    where = ("--sequences", longer, "--metrics", "otb,got10k,vot")
    done = trackmark("compare", "static", "camshift", *where, status=2)
    assert done.stdout == ""
    assert "supervised" in done.stderr


@pytest.mark.slow
def test_stored_runs_of_another_tracker_version_are_named(trackmark, monkeypatch):
    where = ("--sequences", SCENES, "--name", "stored")
    stored = ("compare", "--results", "results/stored")
    trackmark("compare", "static", "camshift", *where)
    assert "another version" not in trackmark(*stored).stderr
    current = tracker_spec.built_in_digest
    monkeypatch.setattr(
        tracker_spec,
        "built_in_digest",
        lambda name: "changed" if name == "static" else current(name),
    )
    message = "static: 2 of 2 stored runs are of another version of the tracker"
    (line,) = [line for line in trackmark(*stored).stderr.splitlines() if "version" in line]
    assert line.startswith(message)


@pytest.mark.slow
def test_families_of_clips_count_once(trackmark, workspace, otb):
    names = [f"clip{n}" for n in range(4)]
    for n, name in enumerate(names):
        otb(workspace / "data" / name, 4 + n)
    where = ("static", "camshift", "--sequences", ",".join(f"data/{name}" for name in names))
    rows = "".join(f"{name},video{n // 2}\n" for n, name in enumerate(names))
    (workspace / "families.csv").write_text(f"sequence,family\n{rows}")
    data = json.loads(trackmark("compare", *where, "--families", "families.csv", "--json").stdout)
    assert (data["unit"], data["units"]) == ("family", ["video0", "video1"])
    (workspace / "families.csv").write_text(f"sequence,family\n{rows[:-13]}")
    message = trackmark("compare", *where, "--families", "families.csv", status=2).stderr
    assert "families.csv: the sequence 'clip3' has no family (1 of 4" in unwrapped(message)
    both = ("--families", "families.csv", "--unit", "scene")
    assert "either --families or --unit" in trackmark("compare", *where, *both, status=2).stderr


@pytest.mark.slow
def test_sequence_of_one_frame_does_not_hide_the_answer(trackmark, workspace, otb):
    otb(workspace / "data" / "Single", 1)
    where = ("--sequences", "data/Small,data/Single", "--name", "mixed")
    printed = unwrapped(trackmark("run", "--trackers", "static,camshift", *where).stdout)
    assert "Mean overlap on this sequence: static 1.00, camshift 0.97." in printed
    assert "Single left out: mean overlap is undefined for all trackers." in printed
    compared = unwrapped(trackmark("compare", "static", "camshift", *where).stdout)
    assert "Single left out: mean overlap is undefined" in compared
    trackmark("run", "--trackers", "static", "--sequences", "data/Single", "--name", "alone")
    alone = trackmark("report", "results/alone").stdout
    assert "no sequence has a target after its first frame" in alone
