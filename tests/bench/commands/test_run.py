"""`trackmark run`: output, stored results, exit status, and errors of the data."""

import re
import shlex
import shutil

import cv2
import pytest

import trackmark as tm
from tests.bench.commands.conftest import SMALL, json_lines, masked, unwrapped
from trackmark.bench.commands._options import memory_size
from trackmark.bench.execution.task import LEAST_MEMORY, Limits
from trackmark.bench.experiments.experiment import default_name
from trackmark.bench.store.runs import Runs

MINE = ("run", "--name", "mine", "--trackers")
RUN = (*MINE, "static", "--sequences")
KNOB = (*MINE, "static,knob.py:Knob", *SMALL)


RUN_OUTPUT = """\
Mean overlap on this sequence: static 1.00, camshift 0.97.
One sequence is too few to generalise (6 needed).

tracker  overlap  0  1  success  error  ms/frame  fps
static  1.00  ##########  100 %  0.0 px  N  N
camshift  0.97  ##########  100 %  0.2 px  N  N
ms/frame on MACHINE
~: next to other trackers; `run --timing` measures without them

2 of 2 runs are in results/mine.
"""
RUN_PROGRESS = """\
HH:MM:SS start  mine: 2 trackers on 1 sequence, 2 runs
HH:MM:SS done  2/2 runs, 0 failed, N s, results/mine
data/Small: read as a folder with img/ and groundtruth_rect.txt (OTB).
Next  trackmark report results/mine
"""


def test_run_prints_answer_table_and_results_folder(trackmark, workspace):
    run = (*MINE, "static,camshift", *SMALL)
    done = trackmark(*run)
    assert masked(done.stdout) == RUN_OUTPUT
    assert masked(done.stderr) == RUN_PROGRESS
    assert len(tm.load_runs(workspace / "results").table) == 2
    quiet = trackmark(*run, "--quiet")
    assert (quiet.stdout, quiet.stderr) == (RUN_OUTPUT.partition("\n")[0] + "\n", "")
    verbose = unwrapped(trackmark(*run, "--verbose").stdout)
    assert "mine: every sequence; metrics native." in verbose


@pytest.mark.slow
def test_many_trackers_need_at_most_20_lines(trackmark):
    trackers = ",".join(f"knob.py:as=mine{number}" for number in range(12))
    lines = trackmark(*MINE, trackers, *SMALL).stdout.splitlines()
    assert len(lines) <= 20
    assert "2 more trackers: --verbose" in lines


@pytest.mark.slow
def test_default_name_depends_on_trackers_sequences_and_truth(trackmark, workspace, otb):
    def folder_of(done):
        return re.search(r"uns (?:are in|go to) ([^ ]+?)\.\s", done.stdout + done.stderr)[1]

    otb(workspace / "b" / "Small", 7)
    (workspace / "truth.csv").write_text("frame,x,y,width,height\n0,5,6,10,12\n4,5,6,10,12\n")
    run = ("run", "--trackers", "static,knob.py:Knob", "--sequences")
    cases = [
        (("data/Small",), "knob.py-Knob+1-on-Small"),
        (("b/Small",), "knob.py-Knob+1-on-Small"),
        (("data/Small/img", "--truth", "truth.csv"), "knob.py-Knob+1-on-img"),
        (("data/Small", "--trackers", "camshift"), "camshift-on-Small"),
        (("samples/*,data/Small",), "knob.py-Knob+1-on-Small+1"),
    ]
    folders = [folder_of(trackmark(*run, *options, "--dry-run")) for options, _ in cases]
    assert len(set(folders)) == len(folders)
    for folder, (_, name) in zip(folders, cases, strict=True):
        assert re.sub(r"-[0-9a-f]{6}$", "", folder) == f"results/{name}"
    assert folder_of(trackmark(*run, "data/Small")) == folders[0]
    reversed_ = ("run", "--trackers", "knob.py:Knob,static", *SMALL, "--repetitions", 2, "--json")
    assert folder_of(trackmark(*reversed_)) == folders[0]
    trackmark(*run, "b/Small", "--results-root", "elsewhere", "--name", "mine")
    assert [file.name for file in (workspace / "elsewhere").iterdir()] == ["mine"]


def test_default_name_has_no_interpreter_or_command():
    names = [
        default_name([text], ["samples/face"])
        for text in (
            "lib/mine.py:Mine:size=2:python=envs/torch/bin/python",
            "lib/mine.py:python=env:as=mine",
            'trax:command="./build/tracker --fast":as=fast',
        )
    ]
    heads = [name.partition("-on-face-")[0] for name in names]
    assert heads == ["mine.py-Mine-size=2", "mine", "fast"]


def test_json_has_one_line_per_run_with_its_scores(trackmark):
    runs = json_lines(trackmark(*KNOB, "--repetitions", 2, "--json"))
    assert {(row["tracker"], row["repetition"]) for row in runs} == {
        ("static", 0),
        ("knob.py:Knob", 0),
        ("knob.py:Knob", 1),
    }
    static = next(row for row in runs if row["tracker"] == "static")
    assert static["scores"]["mean_overlap"] == 1.0
    assert static["scores"]["absence_reported"] is None
    assert "stamp" not in static
    assert json_lines(trackmark(*RUN, "data/Small", "--json")) == [static]


def test_experiment_file_sets_trackers_and_repetitions(trackmark, workspace):
    (workspace / "trial.toml").write_text(
        'version = 1\ntitle = "Mine"\nrepetitions = 3\nsequences = ["data/Small"]\n'
        'trackers = [{name = "camshift", window = ["fixed", "adaptive"]},\n'
        '  { name = "knob.py:Knob", repetitions = 2 }]\n',
        encoding="utf-8-sig",  # as editors on Windows write it
    )
    assert "Mine" in trackmark("run", "trial.toml", "--verbose").stdout
    assert len(tm.load_runs(workspace / "results" / "trial").table) == 4
    (plan,) = json_lines(trackmark("run", "trial.toml", "--repetitions", 4, "--dry-run", "--json"))
    assert (plan["runs"], plan["to_run"]) == (6, 2)


def test_timing_runs_store_times(trackmark, workspace):
    trackmark("run", "--trackers", "static,camshift", *SMALL, "--timing", "--name", "timed")
    table = Runs.open(workspace / "results" / "timed").table
    assert (table["protocol"] == "timing").all()
    assert len(table) == 2
    assert (table["ms_per_frame"] > 0).all()  # also if other load disturbed the runs
    assert (table["ms_per_frame_p95"] >= table["ms_per_frame_median"]).all()
    assert table["run_delay_share"].between(0, 1).all()


@pytest.mark.slow
def test_failed_runs_are_listed_by_the_printed_command(
    trackmark, tracker_processes, workspace, break_tracker
):
    """A process of the tracker is needed: its output is captured there."""
    break_tracker("print('last words'); raise ValueError('no idea')")
    name = '=evil"<b>'
    done = trackmark(*KNOB, "--name", name, status=1)
    assert done.stdout.splitlines()[:4] == [
        "1 of 2 runs FAILED:",
        "        knob.py:Knob on Small, 0002.png: ValueError: no idea",
        "        knob.py, line 24, in update",
        f"Log     trackmark results failures {shlex.quote(f'results/{name}')}",
    ]
    assert done.stdout.count("failed") == 3  # in the answer, in the table and at the end
    assert "last words" not in done.stdout + done.stderr
    verbose = trackmark(*KNOB, "--name", name, "--verbose", status=1).stdout
    assert "Output of knob.py:Knob on Small:\n  | last words\n" in verbose
    assert verbose.endswith("Trackers that printed nothing: static.\n")
    command = shlex.split(re.search("Log     trackmark (.*)", done.stdout)[1])
    assert command == ["results", "failures", f"results/{name}"]
    text = trackmark(*command).stdout
    assert "knob.py:Knob on Small, repetition 0: boxes of 1 of 5 frames" in text
    (row,) = json_lines(trackmark(*command, "--json"))
    assert "in update" in row["failure"]
    assert row["output"] == "last words\n"
    assert "1 of 1 failed" in trackmark("report", f"results/{name}", status=1).stdout


@pytest.mark.slow
def test_stored_failure_gives_exit_status_1_again(trackmark, break_tracker):
    break_tracker()
    for options in ((), (), ("--retry-failed",)):
        text = trackmark(*KNOB, *options, status=1).stdout
        assert "1 of 2 runs are in results/mine, 1 failed." in text


def test_sequence_without_ground_truth_is_shown_but_not_run(trackmark, one_line, workspace):
    images = workspace / "data" / "Small" / "img"
    trackmark("show", images, "--output", "shown.png")
    assert cv2.imread(str(workspace / "shown.png")) is not None
    message = one_line(trackmark(*RUN, images, status=2))
    assert "there is no ground truth" in message
    assert "--truth" in message


def test_damaged_image_costs_only_its_sequence(trackmark, workspace, otb):
    file = otb(workspace / "data" / "Broken", 6) / "img" / "0004.png"
    content = file.read_bytes()
    file.write_bytes(content[:90])
    both = (*MINE, "static,knob.py:Knob", "--sequences", "data/Broken,data/Small")
    done = trackmark(*both, status=2)
    event, message, remedy = [ln for ln in done.stderr.splitlines() if re.search("0004|!B", ln)]
    assert "ERROR" in event
    assert "data/Broken/img/0004.png: frame 3 cannot be read" in message
    assert remedy == "trackmark: To go on without it, add !Broken to the sequences."
    stored = tm.load_runs(workspace / "results").table.query("status == 'finished'")
    assert set(stored["sequence"]) == {"Small"}
    file.write_bytes(content)
    trackmark(*both)


def test_damaged_result_is_named(trackmark, one_line, workspace):
    trackmark(*RUN, "data/Small")
    (file,) = (workspace / "results").rglob("runs.db")
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert "runs.db is damaged" in one_line(trackmark(*RUN, "data/Small", status=2))


def test_table_shows_requested_runs_and_report_all_of_them(trackmark, workspace):
    shutil.copytree(workspace / "data" / "Small", workspace / "data" / "Other")
    trackmark(*RUN, "data/Small")
    text = trackmark(*MINE, "camshift", "--sequences", "data/Other").stdout
    assert "static" not in text
    assert "1 of 1 runs" in text
    text = trackmark("report", "results/mine", "--no-pictures").stdout
    assert text.startswith("There is no answer: no tracker has runs on all sequences.")
    assert "not run: static" in text
    assert "not run: camshift" in text


def test_stale_runs_are_announced_replaced_and_never_averaged(trackmark, workspace):
    knob = (*MINE, "knob.py:Knob", *SMALL, "--repetitions")
    trackmark(*knob, 3)
    file = workspace / "knob.py"
    file.write_text(file.read_text().replace("self.random.random()", "2"))
    done = trackmark(*knob, 2)
    assert "2 runs (replacing stale runs: 2)" in done.stderr
    assert "replaces 2 stale runs, because the tracker or the sequence has changed" in done.stderr
    scores = tm.load_runs(workspace / "results").table.query("status == 'finished'")
    assert len(scores) == 2
    assert scores["mean_overlap"].nunique() == 1
    assert "2 of 2 runs" in done.stdout
    report = ("report", "results/mine", "--no-pictures")
    assert "1 of 3 stale" in trackmark(*report).stdout


def test_other_data_of_the_same_name_replace_no_run(trackmark, one_line, workspace, otb):
    for number, name in enumerate("ab"):
        otb(workspace / name / "clip", 4 + number)
    shutil.copytree(workspace / "a", workspace / "copy of a")
    trackmark(*RUN, "a/clip")
    message = one_line(trackmark(*RUN, "b/clip", status=2))
    assert str(workspace / "a" / "clip") in message
    assert "--name" in message
    assert tm.load_runs(workspace / "results").table["frames"].tolist() == [4]
    assert "stale" not in trackmark(*RUN, "copy of a/clip").stderr
    (workspace / "a" / "clip" / "groundtruth_rect.txt").write_text("5,6,10,11\n" * 4)
    changed = trackmark(*RUN, "a/clip").stderr
    assert "(replacing stale runs: 1)" in changed


def test_dry_run_prints_the_plan_and_writes_nothing(trackmark, workspace):
    shutil.copy(
        workspace / "knob.py", workspace / "_knob.py"
    )  # as a run's folder is, this is not hidden
    knob = (*MINE, "static,_knob.py:Knob", *SMALL, "--repetitions")
    text = trackmark(*knob, 3, "--dry-run").stdout
    assert "Deterministic trackers run once on each sequence." in text
    assert "4 missing runs on 1 sequence.\n" in text
    assert "no finished runs: static, _knob.py:Knob." in text
    assert not (workspace / "results").exists()
    trackmark(*knob, 2)
    (plan,) = json_lines(trackmark(*knob, 3, "--dry-run", "--json"))
    assert plan["trackers"]["_knob.py:Knob"] == {
        "finished": 2,
        "failed": 0,
        "stale": 0,
        "missing": 1,
    }
    assert (plan["runs"], plan["to_run"], plan["tasks"]) == (4, 1, 1)
    assert plan["seconds"] > 0
    assert plan["without_times"] == []
    text = trackmark(*knob, 3, "--dry-run").stdout
    assert re.search(r"1 missing run on 1 sequence, about .* on \d workers?\.", text)


def test_limits_apply_and_their_defaults_are_documented(trackmark, break_tracker):
    text = " ".join(trackmark("run", "--help").stdout.split())
    assert f"[default: {Limits.frame_seconds:g}]" in text
    assert f"[default: {Limits.run_seconds:g}]" in text
    break_tracker("__import__('time').sleep(0.1); return Estimate(self.box)")
    slow = ("run", "--trackers", "knob.py:Knob", *SMALL)
    done = trackmark(*slow, "--run-limit", "0.25", status=1)
    assert "the run took longer than its limit of 0.25 s" in done.stdout
    sizes = {"500MB": 500e6, "4GiB": 2**32, "1.5 g": 1.5e9, "1000": 1000}
    assert {text: memory_size(text) for text in sizes} == sizes
    assert Limits(memory_bytes=memory_size("512MB")).memory_bytes == LEAST_MEMORY
