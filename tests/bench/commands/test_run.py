"""`trackmark run`: what it says, what it leaves, its exit status, and what is wrong with input."""

import json
import re
import shlex
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from trackmark import bench

SMALL = ("--sequences", "data/Small")
MINE = ("run", "--name", "mine", "--trackers")
RUN = (*MINE, "static", "--sequences")
KNOB = (*MINE, "static,knob.py:Knob", *SMALL)


def test_it_prints_a_table_and_says_where_the_results_are(trackmark, here):
    said = trackmark(*MINE, "static,camshift", *SMALL).stdout
    assert "camshift" in said
    assert "native" in said
    assert "2 of 2 runs are in results/mine" in said
    assert "µs a frame and tracker" in said
    assert len(bench.load_results(here / "results")) == 2


def folder_of(done):
    """Where a command says that its runs are."""
    return re.search(r"uns (?:are in|go to) ([^ ]+?)\.\s", done.stdout + done.stderr)[1]


def test_runs_that_are_asked_for_without_a_name_get_one_made_of_what_was_asked(
    trackmark, here, otb
):
    """Else the next run would widen the last one's report, and another truth replace its runs."""
    otb(here / "b" / "Small", 7)
    (here / "truth.csv").write_text("frame,x,y,width,height\n0,5,6,10,12\n4,5,6,10,12\n")
    run = ("run", "--trackers", "static,knob.py:Knob", "--sequences")
    asked = [
        ("data/Small",),
        ("b/Small",),
        ("data/Small/img", "--truth", "truth.csv"),
        ("data/Small", "--trackers", "camshift"),
        ("samples/*,data/Small",),
    ]
    folders = [folder_of(trackmark(*run, *words, "--dry-run")) for words in asked]
    assert len(set(folders)) == len(folders)
    assert [re.sub(r"-[0-9a-f]{6}$", "", folder) for folder in folders] == [
        "results/knob.py-Knob+1-on-Small",
        "results/knob.py-Knob+1-on-Small",
        "results/knob.py-Knob+1-on-img",
        "results/camshift-on-Small",
        "results/knob.py-Knob+1-on-Small+1",
    ]
    assert folder_of(trackmark(*run, "data/Small")) == folders[0]
    turned = ("run", "--trackers", "knob.py:Knob,static", *SMALL, "--seeds", 2, "--json")
    assert folder_of(trackmark(*turned)) == folders[0], "the same, more often"
    trackmark(*run, "b/Small", "--output", "elsewhere", "--name", "mine")
    assert [file.name for file in (here / "elsewhere").iterdir()] == ["mine"]


def refuse(constant):
    raise AssertionError(f"{constant} is no JSON")


def test_json_is_a_line_a_finished_run_with_its_scores(trackmark):
    lines = trackmark(*KNOB, "--seeds", 2, "--json").stdout.splitlines()
    rows = [json.loads(line, parse_constant=refuse) for line in lines]
    assert {(row["tracker"], row["repetition"]) for row in rows} == {
        ("static", 0),
        ("knob.py:Knob", 0),
        ("knob.py:Knob", 1),
    }
    static = next(row for row in rows if row["tracker"] == "static")
    assert static["scores"]["mean_overlap"] == 1.0
    assert static["scores"]["absence_reported"] is None
    assert "stamp" not in static
    again = trackmark(*RUN, "data/Small", "--json").stdout
    assert [json.loads(line) for line in again.splitlines()] == [static]


def test_an_experiment_file_is_run(trackmark, here):
    (here / "trial.toml").write_text(
        'version = 1\ntitle = "Mine"\nsequences = ["data/Small"]\n'
        'trackers = ["static", {name = "camshift", window = ["fixed", "adaptive"]}]\n'
    )
    assert "Mine" in trackmark("run", "trial.toml").stdout
    assert len(bench.load_results(here / "results" / "trial")) == 3


def test_a_tracker_runs_as_often_as_its_experiment_says_and_all_as_often_as_the_command(
    trackmark, here
):
    (here / "trial.toml").write_text(
        'version = 1\nrepetitions = 3\nsequences = ["data/Small"]\n'
        'trackers = ["static", { name = "knob.py:Knob", repetitions = 2 }]\n'
    )
    planned = ("run", "trial.toml", "--dry-run", "--json")
    assert json.loads(trackmark(*planned).stdout)["runs"] == 1 + 2
    assert json.loads(trackmark(*planned, "--seeds", 4).stdout)["runs"] == 1 + 4


def test_timing_runs_store_times(trackmark, here):
    trackmark("run", "--trackers", "static,camshift", *SMALL, "--timing")
    table = bench.load_results(here / "results")
    assert (table["protocol"] == "timing").all()
    steady = table[table["disturbed"] == 0]
    assert len(table) == 2
    assert (steady["cpu_seconds_median"] > 0).all()
    assert (steady["cpu_seconds_p99"] >= steady["cpu_seconds_median"]).all()
    assert table[table["disturbed"] == 1]["cpu_seconds_median"].isna().all()


def test_what_tells_why_runs_failed_is_typed_as_it_stands(trackmark, here, spoil):
    spoil()
    name = '=evil"<b>'
    where = ("--trackers", "knob.py:Knob", "--sequences", "data/Small", "--name", name)
    told = trackmark("run", *where, status=1).stdout
    command = re.search("`trackmark (.*)` tells why", told)[1]
    assert shlex.split(command) == ["results", "failures", f"results/{name}"]


def test_failed_runs_are_shown_and_make_the_exit_status_one(typed, trackmark, spoil):
    """In processes as a user has them: what a tracker prints is told with its failure alone."""
    spoil("print('last words'); raise ValueError('no idea')")
    done = typed(*KNOB, status=1)
    assert "1 of 1 runs failed (left out): sequence Small, ValueError: no idea" in (done.stdout)
    assert "last words" not in done.stdout + done.stderr
    assert "results failures results/mine" in done.stdout
    told = trackmark("results", "failures").stdout
    assert "knob.py:Knob on Small, repetition 0: boxes of 1 of 5 frames" in told
    assert "in update" in told
    assert "| last words" in told
    (line,) = trackmark("results", "failures", "--json").stdout.splitlines()
    assert json.loads(line)["output"] == "last words\n"
    assert "1 of 1 failed" in trackmark("report", "results/mine", status=1).stdout


def test_what_failed_makes_the_status_one_again_and_is_counted_once(trackmark, spoil):
    spoil()
    for more in ((), (), ("--retry-failed",)):
        said = trackmark(*KNOB, *more, status=1).stdout
        assert "1 of 2 runs are in results/mine, 1 failed." in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "--trackers", "statik", *SMALL), "Did you mean 'static'?"),
        (("run", "--trackers", "static:preset=x", *SMALL), "preset of static 'x'"),
        (("run", "--trackers", "camshift:bins=3", *SMALL), "'hue_bins'"),
        (("run", "--trackers", "camshift:hue_bins=0", *SMALL), "hue_bins=0"),
        (("run", "--trackers", "camshift:hue_bins=many", *SMALL), "hue_bins=many"),
        ((*RUN, "samples/fce"), "'samples/face'"),
        ((*RUN, "samples/*,nothing/*"), "'nothing/*' matches no sequence"),
        (("run", "--trackers", ",", *SMALL), "a tracker and a sequence"),
        ((*RUN, "data/Small", "data/Small/img"), "data/Small/img is no experiment."),
        ((*RUN, "data", "data/Small", "knob.py"), "in quotes, for your shell"),
        (("run", "demo", "demo"), "one experiment, not 2"),
        (("run", "--trackers", "static", "--sequences", ","), "a tracker and a sequence"),
        ((*RUN, "plain/target:sped=3"), "'speed'"),
        ((*RUN, "nowhere"), "nowhere"),
        ((*RUN, "data/Small", "--frame-limit", "0"), "more than 0"),
        ((*RUN, "data/Small", "--engine", "dusk"), "Did you mean 'dask'"),
        ((*RUN, "data/Small", "--address", "tcp://nowhere:1"), "the local engine has no address"),
        (("run", "nonsense"), "unknown experiment 'nonsense'"),
        (("run", "missing.toml"), "missing.toml"),
        (("describe", "nonsense"), "nonsense"),
        (("report", "nowhere"), "nowhere"),
        (("results", "list", "nowhere"), "nowhere"),
    ],
)
def test_wrong_input_is_one_line_with_the_culprit_and_exit_status_two(
    trackmark, one_line, arguments, words
):
    line = one_line(trackmark(*arguments, status=2))
    assert line.startswith("trackmark: ")
    assert words in line


def test_a_sequence_without_truth_opens_and_shows_but_is_not_run(trackmark, one_line, here):
    images = here / "data" / "Small" / "img"
    assert "none" in trackmark("describe", images).stdout
    trackmark("show", images, "--output", "shown.png")
    assert cv2.imread(str(here / "shown.png")) is not None
    line = one_line(trackmark(*RUN, images, status=2))
    assert "there is no truth" in line
    assert "--truth" in line


@pytest.mark.parametrize(
    ("name", "truth", "words"),
    [
        ("TooMany", "5,6,10,12\n" * 7, "7 truth rows for 5 images"),
        ("NoSize", "5,6,0,12\n" * 5, "groundtruth_rect.txt"),
        ("Outside", "500,600,10,12\n" * 5, "outside"),
    ],
)
def test_bad_truth_is_named_with_its_file(trackmark, one_line, here, name, truth, words):
    folder = here / "data" / name
    shutil.copytree(here / "data" / "Small", folder)
    (folder / "groundtruth_rect.txt").write_text(truth)
    line = one_line(trackmark(*RUN, f"data/{name}", status=2))
    assert words in line
    assert name in line


def test_a_corrupt_image_is_named_and_the_other_sequences_are_finished_and_kept(
    trackmark, one_line, here
):
    folder = here / "data" / "Broken"
    (folder / "img").mkdir(parents=True)
    rng = np.random.default_rng(0)
    for i in range(6):
        image = cv2.resize(rng.integers(0, 256, (6, 8, 3), dtype=np.uint8), (80, 60))
        cv2.imwrite(str(folder / "img" / f"{i + 1:04}.jpg"), image)
    (folder / "groundtruth_rect.txt").write_text("5,6,10,12\n" * 6)
    file = folder / "img" / "0004.jpg"
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    line = one_line(trackmark(*RUN, "data/Broken,data/Small,samples/face", status=2))
    assert "0004.jpg" in line
    kept = bench.load_results(here / "results").query("status == 'finished'")
    assert sorted(kept["sequence"]) == ["Small", "samples/face"]
    file.write_bytes(whole)
    trackmark(*RUN, "data/Broken,data/Small,samples/face")


def test_one_bad_image_is_one_line_however_many_runs_it_costs(trackmark, here):
    file = here / "data" / "Small" / "img" / "0004.png"
    file.write_bytes(file.read_bytes()[:90])
    done = trackmark(*KNOB, "--seeds", 3, "--timing", status=2)
    ours = [line for line in done.stderr.splitlines() if line.startswith("trackmark: ")]
    assert len(ours) == 1
    assert "0004.png" in ours[0]


def test_a_results_folder_that_cannot_be_written_is_named(trackmark, one_line, here):
    (here / "file").write_text("")
    line = one_line(trackmark(*RUN, "data/Small", "--output", "file/results", status=2))
    assert "file/results" in line
    assert "--output" in line


def test_a_damaged_result_is_named(trackmark, one_line, here):
    trackmark(*RUN, "data/Small")
    (file,) = (here / "results").rglob("runs.db")
    file.write_bytes(file.read_bytes()[:-20])
    assert "runs.db is damaged" in one_line(trackmark(*RUN, "data/Small", status=2))


def test_a_table_shows_what_was_asked_for_now_and_the_report_everything(trackmark, here):
    shutil.copytree(here / "data" / "Small", here / "data" / "Other")
    trackmark(*RUN, "data/Small")
    said = trackmark(*MINE, "camshift", "--sequences", "data/Other").stdout
    assert "static" not in said
    assert "1 of 1 runs" in said
    said = trackmark("report", "results/mine").stdout
    assert "not run: static" in said
    assert "not run: camshift" in said


def test_runs_of_an_older_tracker_are_announced_replaced_and_never_averaged(trackmark, here):
    knob = (*MINE, "knob.py:Knob", *SMALL, "--seeds")
    trackmark(*knob, 3)
    file = here / "knob.py"
    file.write_text(file.read_text().replace("self.random.random()", "2"))
    said = trackmark(*knob, 2)
    announced, _, became = said.stderr.partition("What became of the scores of 2 runs")
    assert "2 stored runs were made with another version" in announced
    (first,), (before,), (after,) = (
        [line.partition(stage)[2] for line in text.splitlines() if f"Knob  {stage} " in line]
        for text, stage in ((announced, "before"), (became, "before"), (became, "after"))
    )
    assert first.split() == before.replace("*", "").split()
    scores = bench.load_results(here / "results").query("status == 'finished'")
    assert f"{scores['mean_overlap'].mean():.3f}" in after
    assert f"{scores['mean_overlap'].mean():.3f}" not in before
    assert "2 of 2 runs" in said.stdout
    assert "1 of 3 stale" in trackmark("report", "results/mine").stdout


def test_why_replaced_runs_failed_is_told_once_before_and_once_after(trackmark, spoil, here):
    knob = (*MINE, "knob.py:Knob", *SMALL)
    spoil()
    trackmark(*knob, status=1)
    file = here / "knob.py"
    file.write_text(file.read_text().replace("no idea", "still none"))
    said = trackmark(*knob, status=1)
    assert [word in said.stderr for word in ("no idea", "still none")] == [True, False]
    assert said.stderr.count("runs failed (") == said.stdout.count("runs failed (") == 1
    assert "of the scores of 1 run that was replaced" in said.stderr


def test_runs_that_would_be_replaced_are_kept_where_that_is_asked_for(trackmark, here):
    knob = (*MINE, "knob.py:Knob", *SMALL, "--keep")
    file = here / "knob.py"
    for change in ("2", "2", "3"):
        file.write_text(re.sub(r"\[[^,]*, 0, 0, 0", f"[{change}, 0, 0, 0", file.read_text()))
        said = trackmark(*knob)
        assert "done again" not in said.stderr
    assert "results/mine-2" in said.stdout
    runs = bench.load_results(here / "results")
    assert runs["experiment"].tolist() == ["mine", "mine-2"]
    assert runs["mean_overlap"].is_monotonic_decreasing
    reported = trackmark("report", "results").stdout
    assert [line.split(": ")[0] for line in reported.splitlines() if "metrics" in line] == [
        "mine",
        "mine-2",
    ]


def test_runs_on_other_data_of_the_same_name_are_kept(trackmark, one_line, here, otb):
    """They would be taken for runs on an older state of the same data, and replaced."""
    for number, name in enumerate("ab"):
        otb(here / name / "clip", 4 + number)
    shutil.copytree(here / "a", here / "copy of a")
    trackmark(*RUN, "a/clip")
    line = one_line(trackmark(*RUN, "b/clip", status=2))
    assert str(here / "a" / "clip") in line
    assert "--name" in line
    assert bench.load_results(here / "results")["frames"].tolist() == [4]
    assert "done again" not in trackmark(*RUN, "copy of a/clip").stderr
    (here / "a" / "clip" / "groundtruth_rect.txt").write_text("5,6,10,11\n" * 4)
    assert "1 stored run was" in trackmark(*RUN, "a/clip").stderr, "the same data, changed"


def test_a_tracker_file_may_begin_with_an_underscore(trackmark, here):
    shutil.copy(here / "knob.py", here / "_knob.py")
    chosen = ("run", "--trackers", "_knob.py:Knob", *SMALL)
    assert "missing" not in trackmark(*chosen).stdout
    assert len(trackmark(*chosen, "--json").stdout.splitlines()) == 1


def test_a_dry_run_prints_the_plan_and_leaves_nothing(trackmark, here):
    said = trackmark(*KNOB, "--seeds", 3, "--dry-run").stdout
    assert "4 of 4 runs on 1 sequences are to be run" in said
    assert "first frames on the shortest sequence" in said
    assert not (here / "results").exists()
    trackmark(*KNOB, "--seeds", 2)
    told = json.loads(trackmark(*KNOB, "--seeds", 3, "--dry-run", "--json").stdout)
    assert told["trackers"]["knob.py:Knob"] == {"done": 2, "failed": 0, "stale": 0, "left": 1}
    assert (told["runs"], told["to_run"], told["units"]) == (4, 1, 1)
    assert 0 < told["seconds"][0] <= told["seconds"][1]
    assert told["estimated_from"] == {"sequence": 1}


def test_limits_are_kept_and_their_defaults_are_told(trackmark, spoil):
    from trackmark.bench.engine.work_unit import Limits

    said = " ".join(trackmark("run", "--help").stdout.split())
    assert f"[default: {Limits.frame_seconds:g}]" in said
    assert f"[default: {Limits.run_seconds:g}]" in said
    spoil("__import__('time').sleep(0.1); return Estimate(self.box)")
    slow = ("run", "--trackers", "knob.py:Knob", *SMALL)
    done = trackmark(*slow, "--run-limit", "0.25", status=1)
    assert "the run took longer than its limit of 0.25 s" in " ".join(done.stdout.split())


@pytest.mark.parametrize(
    ("text", "size"), [("500MB", 500e6), ("4GiB", 2**32), ("1.5 g", 1.5e9), ("1000", 1000)]
)
def test_a_size_is_read_as_it_is_written(text, size):
    from trackmark.bench.commands._options import memory_size

    assert memory_size(text) == size


SHARED = Path(__file__).parents[3].parent / "shared" / "sequences"


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recorded sequences beside the checkout")
def test_recorded_otb_sequences_run(trackmark, here):
    names = ",".join(str(SHARED / "otb" / name) for name in ("Crossing", "Couple"))
    trackmark("run", "--trackers", "static,camshift", "--sequences", names)
    table = bench.load_results(here / "results").set_index(["tracker", "sequence"])
    assert table.loc[("static", "Crossing"), "evaluated_frames"] == 119
    assert table.loc[("static", "Couple"), "evaluated_frames"] == 139


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recorded sequences beside the checkout")
def test_recorded_sequences_run_with_mil_and_a_video_with_converted_truth(typed, here):
    names = ",".join(str(SHARED / "otb" / name) for name in ("Crossing", "Couple"))
    trackers = "static,camshift,opencv-mil"
    typed("run", "--trackers", trackers, "--sequences", names, "--seeds", 5)
    assert len(bench.load_results(here / "results")) == 2 * (1 + 1 + 5)
    polygons = np.loadtxt(SHARED / "vot" / "bag" / "groundtruth.txt", delimiter=",")
    low, high = (end(polygons.reshape(-1, 4, 2), axis=1) for end in (np.min, np.max))
    lines = ["frame,x,y,width,height"]
    lines += [
        ",".join(map(str, [i, *(a - 1), *(b - a)]))
        for i, (a, b) in enumerate(zip(low, high, strict=True))
    ]
    (here / "bag.csv").write_text("\n".join(lines) + "\n")
    video = SHARED / "video" / "bag.avi"
    arguments = ("--sequences", video, "--truth", "bag.csv", "--name", "bag")
    typed("run", "--trackers", "static,camshift", *arguments)
    table = bench.load_results(here / "results" / "bag")
    assert (table["evaluated_frames"] == 195).all()
