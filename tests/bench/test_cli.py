"""The command line as a user types it: what it says, what it leaves, its exit status."""

import json
import os
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import bench
from bench.compilation import SENTENCE

SCRIPT = Path(sys.executable).parent / "trackmark"
COMMANDS = sorted(file.stem for file in (Path(bench.__file__).parent / "commands").glob("[!_]*.py"))


def one_line(done):
    """The only line of the error output, but for that on compiling."""
    lines = [line for line in done.stderr.strip().splitlines() if line != SENTENCE]
    assert len(lines) == 1, done.stderr
    return lines[0]


def test_help_lists_every_command_and_answers_quickly():
    def cpu_seconds(command):
        before = os.times()
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        after = os.times()
        return (
            after.children_user
            + after.children_system
            - before.children_user
            - before.children_system,
            done.stdout,
        )

    # Against another process that starts Python and reads as much metadata, so that a busy
    # machine does not decide; 0.2 s is some five times that here.
    pairs = []
    for _ in range(5):
        spent, said = cpu_seconds([SCRIPT, "--help"])
        bare, _ = cpu_seconds([sys.executable, "-c", "import importlib.metadata, email.parser"])
        pairs.append(spent / bare)
    assert min(pairs) < 5
    for name in (
        "demo",
        "list",
        "describe",
        "run",
        "report",
        "results",
        "show",
        "annotate",
        "doctor",
    ):
        assert f"\n  {name} " in said


def test_help_imports_no_numerics():
    code = (
        "import sys, bench.cli\n"
        "try: bench.cli.main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'cv2', 'numba', 'pandas', 'pyarrow', 'matplotlib'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command):
    done = subprocess.run([SCRIPT, command, "--help"], capture_output=True, text=True, check=True)
    assert f"Usage: trackmark {command}" in done.stdout


def test_list_names_everything(trackmark):
    said = trackmark("list").stdout
    for name in ("static", "camshift", "opencv-kcf", "samples/bow-tie", "plain/target", "demo"):
        assert f"  {name} " in said
    found = json.loads(trackmark("list", "trackers", "--json").stdout)
    assert list(found) == ["trackers"]
    assert "static" in found["trackers"]


def test_listing_opens_no_sequence_and_imports_neither_kernels_nor_tables():
    code = (
        "import sys, bench.cli, datasets\n"
        "datasets.load = None\n"
        "try: bench.cli.main(['list'])\n"
        "except SystemExit as ended: assert not ended.code\n"
        "print(sorted({'numba', 'pandas', 'pyarrow', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "multipart/1" in done.stdout
    assert done.stdout.splitlines()[-1] == "[]"


def test_describe_a_tracker_gives_paper_presets_and_parameters(trackmark):
    said = trackmark("describe", "camshift").stdout
    for word in ("Bradski", "as-written", "recommended", "window=fixed", "hue_bins=32", "[pixels]"):
        assert word in said
    about = json.loads(trackmark("describe", "camshift", "--json").stdout)
    assert {parameter["name"] for parameter in about["parameters"]} >= {"window", "hue_bins"}


def test_describe_a_sequence_gives_size_and_truth(trackmark):
    said = trackmark("describe", "samples/face").stdout
    assert "176x144" in said
    assert "120 of 120 frames" in said


def test_run_prints_a_table_and_says_where_the_results_are(trackmark, here):
    said = trackmark("run", "--trackers", "static,camshift", "--sequences", "data/Small").stdout
    assert "camshift" in said
    assert "native" in said
    assert "2 of 2 runs are in results/adhoc" in said
    assert "µs a frame and tracker" in said
    assert len(bench.load_results(here / "results")) == 2


def test_run_json_is_a_line_a_finished_run_with_its_scores(trackmark):
    done = trackmark(
        "run",
        "--trackers",
        "static,knob.py:Knob",
        "--sequences",
        "data/Small",
        "--seeds",
        "2",
        "--json",
    )
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert {(row["tracker"], row["repetition"]) for row in rows} == {
        ("static", 0),
        ("knob.py:Knob", 0),
        ("knob.py:Knob", 1),
    }
    static = next(row for row in rows if row["tracker"] == "static")
    assert static["scores"]["mean_overlap"] == 1.0
    assert static["scores"]["absence_reported"] is None
    again = trackmark("run", "--trackers", "static", "--sequences", "data/Small", "--json").stdout
    assert [json.loads(line) for line in again.splitlines()] == [static]


def test_run_an_experiment_file(trackmark, here):
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
    trackmark("run", "--trackers", "static,camshift", "--sequences", "samples/face", "--timing")
    table = bench.load_results(here / "results")
    assert (table["protocol"] == "timing").all()
    steady = table[table["disturbed"] == 0]
    assert len(table) == 2
    assert (steady["cpu_seconds_median"] > 0).all()
    assert (steady["cpu_seconds_p99"] >= steady["cpu_seconds_median"]).all()
    assert table[table["disturbed"] == 1]["cpu_seconds_median"].isna().all()


def test_failed_runs_are_shown_and_make_the_exit_status_one(trackmark, here):
    file = here / "knob.py"
    fail = "print('last words'); raise ValueError('no idea')  #"
    file.write_text(file.read_text().replace("return Estimate", fail))
    done = trackmark(
        "run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", status=1
    )
    assert "0002.png: ValueError: no idea" in done.stdout
    assert "last words" not in done.stdout + done.stderr
    assert "results failures results/adhoc" in done.stdout
    told = trackmark("results", "failures").stdout
    assert "knob.py:Knob on Small, repetition 0: boxes of 1 of 5 frames" in told
    assert "in update" in told
    assert "| last words" in told
    (line,) = trackmark("results", "failures", "--json").stdout.splitlines()
    assert json.loads(line)["output"] == "last words\n"
    assert trackmark("run", "--trackers", "knob.py:Knob", "--sequences", "data/Small", status=1)


RUN = ("run", "--trackers", "static", "--sequences")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "--trackers", "statik", "--sequences", "data/Small"), "Did you mean 'static'?"),
        (
            ("run", "--trackers", "static:preset=x", "--sequences", "data/Small"),
            "preset of static 'x'",
        ),
        (("run", "--trackers", "camshift:bins=3", "--sequences", "data/Small"), "'hue_bins'"),
        (("run", "--trackers", "camshift:hue_bins=0", "--sequences", "data/Small"), "hue_bins=0"),
        (
            ("run", "--trackers", "camshift:hue_bins=many", "--sequences", "data/Small"),
            "hue_bins=many",
        ),
        ((*RUN, "samples/fce"), "'samples/face'"),
        ((*RUN, "samples/*,nothing/*"), "'nothing/*' matches none"),
        ((*RUN, "plain/target:sped=3"), "'speed'"),
        ((*RUN, "nowhere"), "nowhere"),
        (("run", "nonsense"), "unknown experiment 'nonsense'"),
        (("run", "missing.toml"), "missing.toml"),
        (("describe", "nonsense"), "nonsense"),
        (("report", "nowhere"), "nowhere"),
        (("results", "list", "nowhere"), "nowhere"),
    ],
)
def test_wrong_input_is_one_line_with_the_culprit_and_exit_status_two(trackmark, arguments, words):
    line = one_line(trackmark(*arguments, status=2))
    assert line.startswith("trackmark: ")
    assert words in line


def test_a_sequence_without_truth_opens_and_shows_but_is_not_run(trackmark, here):
    images = here / "data" / "Small" / "img"
    assert "none" in trackmark("describe", images).stdout
    trackmark("show", images, "--output", "shown.png")
    assert cv2.imread(str(here / "shown.png")) is not None
    line = one_line(trackmark(*RUN, images, status=2))
    assert "there is no truth" in line
    assert "--truth" in line


def otb(here, name, truth, n=5):
    folder = here / "data" / name
    shutil.copytree(here / "data" / "Small", folder)
    (folder / "groundtruth_rect.txt").write_text(truth)
    return f"data/{name}"


@pytest.mark.parametrize(
    ("name", "truth", "words"),
    [
        ("TooMany", "5,6,10,12\n" * 7, "7 truth rows for 5 images"),
        ("NoSize", "5,6,0,12\n" * 5, "groundtruth_rect.txt"),
        ("Outside", "500,600,10,12\n" * 5, "outside"),
    ],
)
def test_bad_truth_is_named_with_its_file(trackmark, here, name, truth, words):
    line = one_line(trackmark(*RUN, otb(here, name, truth), status=2))
    assert words in line
    assert name in line


def test_a_corrupt_image_is_named_and_the_other_sequences_are_finished_and_kept(trackmark, here):
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


def test_a_results_folder_that_cannot_be_written_is_named(trackmark, here):
    (here / "file").write_text("")
    line = one_line(trackmark(*RUN, "data/Small", "--output", "file/results", status=2))
    assert "file/results" in line
    assert "--output" in line


def test_a_damaged_result_is_named(trackmark, here):
    trackmark(*RUN, "data/Small")
    (file,) = (here / "results").rglob("*.parquet")
    file.write_bytes(file.read_bytes()[:-20])
    line = one_line(trackmark(*RUN, "data/Small", status=2))
    assert "0.parquet is damaged" in line


def test_results_are_listed_merged_and_removed(trackmark, here):
    trackmark(*RUN, "data/Small", "--name", "a")
    trackmark("run", "--trackers", "camshift", "--sequences", "data/Small", "--name", "b")
    assert "static on Small: 1" in trackmark("results", "list").stdout
    assert (
        "Copied 2 runs"
        in trackmark("results", "merge", "results/a", "results/b", "results/c").stdout
    )
    assert "Copied 0 runs" in trackmark("results", "merge", "results/a", "results/c").stdout
    assert len(bench.load_results(here / "results" / "c")) == 2
    removed = trackmark("results", "remove", "results/c", "--tracker", "cam*", "--yes")
    assert "Removed 1 runs" in removed.stdout
    rows = [
        json.loads(line)
        for line in trackmark("results", "list", "results/c", "--json").stdout.splitlines()
    ]
    assert [row["tracker"] for row in rows] == ["static"]


def test_merging_runs_that_differ_is_refused_and_copies_nothing(trackmark, here):
    trackmark("run", "--trackers", "knob.py:Knob", "--sequences", "data/Small", "--name", "a")
    with (here / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    trackmark(
        "run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", "--name", "b"
    )
    done = trackmark("results", "merge", "results/b", "results/a", status=1)
    assert "conflict: knob.py" in done.stderr
    assert bench.load_results(here / "results" / "a")["tracker"].tolist() == ["knob.py:Knob"]


def test_report_writes_tables_in_every_format_and_plots(trackmark, here):
    trackmark(
        "run",
        "--trackers",
        "static,camshift,knob.py:Knob",
        "--sequences",
        "data/Small,samples/face",
        "--seeds",
        "2",
    )
    said = trackmark("report", "results/adhoc", "--folder", "report").stdout
    suffixes = {file.suffix for file in (here / "report").rglob("*") if file.is_file()}
    assert {".txt", ".md", ".csv", ".tex", ".png"} <= suffixes
    assert "camshift" in said
    markdown = trackmark("report", "results/adhoc", "--format", "markdown").stdout
    assert markdown.count("|") > 10


def test_show_makes_a_film_strip_and_an_h264_video(trackmark, here):
    import av

    trackmark(*RUN, "samples/face")
    trackmark("show", "samples/face", "--results", "results/adhoc", "--output", "strip.png")
    assert cv2.imread(str(here / "strip.png")).shape[1] > 800
    trackmark("show", "samples/face", "--results", "results/adhoc", "--output", "video.mp4")
    with av.open(str(here / "video.mp4")) as video:
        assert video.streams.video[0].codec_context.name == "h264"
        assert sum(1 for _ in video.decode(video=0)) == 120


def test_annotate_writes_a_truth_that_runs(trackmark, here):
    source = here / "data" / "Small" / "img"
    said = trackmark(
        "annotate", source, "--box", "0:4,5,10,12", "--box", "4:8,5,10,12", "--output", "truth.csv"
    ).stdout
    assert "truth.csv" in said
    text = (here / "truth.csv").read_text()
    assert "interpolated" in text
    trackmark(*RUN, source, "--truth", "truth.csv")
    scores = bench.load_results(here / "results").iloc[0]
    assert scores["centre_error"] == pytest.approx(statistics.mean([1, 2, 3, 4]))
    assert (here / "truth-check.png").is_file()


def test_doctor_is_content_and_says_what_is_installed(trackmark):
    about = json.loads(trackmark("doctor", "--json").stdout)
    assert about["problems"] == []
    assert about["trackers"]["static"] == "ready"
    assert (
        "opencv-python-headless" in about["versions"]
        or "opencv-contrib-python-headless" in about["versions"]
    )


def test_a_reader_that_goes_away_is_no_error():
    done = subprocess.run(
        f"{SCRIPT} list | head -1", shell=True, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""


SHARED = Path(__file__).parents[2].parent / "shared" / "sequences"


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recorded sequences beside the checkout")
def test_recorded_otb_sequences_run(trackmark, here):
    names = ",".join(str(SHARED / "otb" / name) for name in ("Crossing", "Couple"))
    trackmark("run", "--trackers", "static,camshift", "--sequences", names, "--seeds", "5")
    table = bench.load_results(here / "results").set_index(["tracker", "sequence"])
    assert table.loc[("static", "Crossing"), "evaluated_frames"] == 119
    assert table.loc[("static", "Couple"), "evaluated_frames"] == 139


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recorded sequences beside the checkout")
def test_recorded_sequences_run_with_mil_and_a_video_with_converted_truth(trackmark, here):
    names = ",".join(str(SHARED / "otb" / name) for name in ("Crossing", "Couple"))
    trackmark(
        "run", "--trackers", "static,camshift,opencv-mil", "--sequences", names, "--seeds", "5"
    )
    assert len(bench.load_results(here / "results")) == 2 * (1 + 1 + 5)
    polygons = np.loadtxt(SHARED / "vot" / "bag" / "groundtruth.txt", delimiter=",").reshape(
        -1, 4, 2
    )
    low, high = polygons.min(axis=1), polygons.max(axis=1)
    lines = ["frame,x,y,width,height"]
    lines += [
        ",".join(map(str, [i, *(a - 1), *(b - a)]))
        for i, (a, b) in enumerate(zip(low, high, strict=True))
    ]
    (here / "bag.csv").write_text("\n".join(lines) + "\n")
    video = SHARED / "video" / "bag.avi"
    trackmark(
        "run",
        "--trackers",
        "static,camshift",
        "--sequences",
        video,
        "--truth",
        "bag.csv",
        "--name",
        "bag",
    )
    table = bench.load_results(here / "results" / "bag")
    assert (table["evaluated_frames"] == 195).all()


def test_annotating_again_reaches_beyond_the_last_row_of_the_old_truth(trackmark, here):
    source = here / "data" / "Small" / "img"
    trackmark("annotate", source, "--box", "0:4,5,10,12", "--box", "2:8,5,10,12")
    assert len((source / "truth.csv").read_text().splitlines()) > 3
    again = ("annotate", source, "--box", "0:4,5,10,12", "--box", "4:8,5,10,12")
    assert "--force" in one_line(trackmark(*again, status=2))
    trackmark(*again, "--force", "--absent", "2-3")
    said = trackmark("describe", source).stdout
    assert "3 of 5 frames" in said
    assert (source.parent / "img-check.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--box", "0:1,2,3"), "FRAME:X,Y,WIDTH,HEIGHT"),
        (("--box", "x"), "FRAME:X,Y,WIDTH,HEIGHT"),
        (("--box", "0:1,2,3,4"), "at least two"),
        (("--box", "0:1,2,3,4", "--box", "1:1,2,3,4", "--output", "a.jpg"), ".csv"),
        (("--box", "0:1,2,3,4", "--box", "9:1,2,3,4"), "frame 9"),
        (("--box", "0:1,2,3,0", "--box", "1:1,2,3,4"), "frame 0"),
        (("--box", "0:1,2,3,4", "--box", "1:1,2,3,4", "--absent", "x"), "FIRST-LAST"),
        ((), "key frames"),
    ],
)
def test_annotate_names_what_is_wrong(trackmark, here, arguments, words):
    said = trackmark("annotate", here / "data" / "Small" / "img", *arguments, status=2).stderr
    assert words in said
    assert not (here / "data" / "Small" / "img" / "truth.csv").exists()


def test_a_table_shows_what_was_asked_for_now_and_the_report_everything(trackmark, here):
    shutil.copytree(here / "data" / "Small", here / "data" / "Other")
    trackmark(*RUN, "data/Small")
    said = trackmark("run", "--trackers", "camshift", "--sequences", "data/Other").stdout
    assert "static" not in said
    assert "1 of 1 runs" in said
    said = trackmark("report", "results/adhoc").stdout
    assert "not run: static" in said
    assert "not run: camshift" in said


def test_runs_of_an_older_tracker_are_announced_replaced_and_never_averaged(trackmark, here):
    knob = ("run", "--trackers", "knob.py:Knob", "--sequences", "data/Small", "--seeds")
    trackmark(*knob, "3")
    with (here / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    said = trackmark(*knob, "2")
    assert "2 stored runs were made with another version" in said.stderr
    assert "2 of 2 runs" in said.stdout
    assert "1 of 3 stale" in trackmark("report", "results/adhoc").stdout


def test_a_retried_run_is_counted_once(trackmark, here):
    file = here / "knob.py"
    file.write_text(file.read_text().replace("return Estimate", "raise ValueError  #"))
    chosen = ("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small")
    assert "2 of 2 runs" in trackmark(*chosen, status=1).stdout
    assert "2 of 2 runs" in trackmark(*chosen, "--retry-failed", status=1).stdout


def test_a_tracker_file_may_begin_with_an_underscore(trackmark, here):
    shutil.copy(here / "knob.py", here / "_knob.py")
    chosen = ("run", "--trackers", "_knob.py:Knob", "--sequences", "data/Small")
    assert "missing" not in trackmark(*chosen).stdout
    assert len(trackmark(*chosen, "--json").stdout.splitlines()) == 1


def test_one_bad_image_is_one_line_however_many_runs_it_costs(trackmark, here):
    file = here / "data" / "Small" / "img" / "0004.png"
    file.write_bytes(file.read_bytes()[:90])
    chosen = ("--trackers", "static,knob.py:Knob", "--sequences", "data/Small", "--seeds", "3")
    done = trackmark("run", *chosen, "--timing", status=2)
    ours = [line for line in done.stderr.splitlines() if line.startswith("trackmark: ")]
    assert len(ours) == 1
    assert "0004.png" in ours[0]


def refuse(constant):
    raise AssertionError(f"{constant} is no JSON")


def test_json_is_json(trackmark):
    rows = trackmark("run", "--trackers", "static", "--sequences", "data/Small", "--json").stdout
    rows += trackmark("results", "list", "--json").stdout
    for line in rows.splitlines():
        assert "stamp" not in json.loads(line, parse_constant=refuse)


def test_a_report_draws_strips_of_recorded_data_and_only_while_they_are_the_same(trackmark, here):
    trackmark(*RUN, "data/Small,samples/face")
    trackmark("report", "results/adhoc", "--folder", "first")
    assert (here / "first" / "strip-Small.png").is_file()
    assert (here / "first" / "strip-samples-face.png").is_file()
    truth = here / "data" / "Small" / "groundtruth_rect.txt"
    truth.write_text(truth.read_text().replace("5,6,10,12", "5,6,10,13", 1))
    said = trackmark("report", "results/adhoc", "--folder", "second").stderr
    assert "Small: no film strip" in said
    assert not (here / "second" / "strip-Small.png").exists()
    done = trackmark("show", "data/Small", "--results", "results", "--output", "a.png", status=2)
    assert "another version" in one_line(done)


def test_a_foreign_package_of_our_name_is_one_line(here):
    (here / "clash" / "datasets").mkdir(parents=True)
    (here / "clash" / "datasets" / "__init__.py").write_text("")
    environment = os.environ | {"PYTHONPATH": str(here / "clash")}
    done = subprocess.run(
        [SCRIPT, "list"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert one_line(done).startswith("trackmark: the package 'datasets' would come from")


@pytest.mark.slow
def test_the_demo_runs_and_draws_its_pictures(trackmark, here):
    said = trackmark("demo", "--output", "out").stdout
    for tracker in ("static", "camshift", "camshift:window=adaptive", "opencv-mil"):
        assert f"{tracker} " in said
    shown = [line.strip() for line in said.splitlines() if line.strip().endswith(".png")]
    assert len(shown) == 8
    assert all(cv2.imread(str(here / path)) is not None for path in shown)
    assert "18 of 18 runs" in said


def test_show_never_overwrites_what_it_shows(trackmark, here):
    trackmark("show", "data/Small/img", "--output", "mine.mp4")
    whole = (here / "mine.mp4").read_bytes()
    assert "overwritten" in trackmark("show", "mine.mp4", "--output", "mine.mp4", status=2).stderr
    assert (here / "mine.mp4").read_bytes() == whole
    image = "data/Small/img/0001.png"
    assert "overwritten" in trackmark("show", "data/Small", "--output", image, status=2).stderr


def test_a_dry_run_prints_the_plan_and_leaves_nothing(trackmark, here):
    chosen = ("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", "--seeds")
    said = trackmark(*chosen, "3", "--dry-run").stdout
    assert "4 of 4 runs on 1 sequences are to be run" in said
    assert "first frames on the shortest sequence" in said
    assert not (here / "results").exists()
    trackmark(*chosen, "2")
    told = json.loads(trackmark(*chosen, "3", "--dry-run", "--json").stdout)
    assert told["trackers"]["knob.py:Knob"] == {"done": 2, "failed": 0, "stale": 0, "left": 1}
    assert (told["runs"], told["to_run"], told["units"]) == (4, 1, 1)
    assert 0 < told["seconds"][0] <= told["seconds"][1]
    assert told["estimated_from"] == {"sequence": 1}


def test_a_log_tells_what_was_done_and_who_failed(trackmark, here):
    file = here / "knob.py"
    file.write_text(file.read_text().replace("return Estimate", "raise ValueError('no idea')  #"))
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", status=1)
    said = trackmark("results", "log").stdout
    assert "start of adhoc: 2 runs (0 done, 0 failed, 0 stale, 2 left)" in said
    assert "failed: knob.py:Knob, repetition 0: 0002.png: ValueError: no idea" in said
    assert "finished after" in said
    events = [
        json.loads(line) for line in trackmark("results", "log", "--json").stdout.splitlines()
    ]
    units = [event for event in events if event["event"] == "unit"]
    assert [event["event"] for event in events] == ["start", *["unit"] * len(units), "end"]
    assert sum(len(runs) for unit in units for runs in unit["runs"].values()) == 2
    for unit in units:
        assert unit["peak_memory"] > 1e6
        assert unit["seconds"] > 0
    (log,) = (here / "results" / "adhoc" / "_log").iterdir()
    log.write_text(log.read_text().replace("static", "statix"))
    assert "is damaged" in one_line(trackmark("results", "log", status=2))


def test_results_that_failed_or_never_ended_are_listed(trackmark, here):
    from bench.store.unfinished import map_rows

    file = here / "knob.py"
    file.write_text(file.read_text().replace("return Estimate", "raise ValueError  #"))
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", status=1)
    rows = map_rows(here / "results" / "adhoc" / "static" / "Small" / "7.unfinished.npy", 5, 6)
    rows[:2] = 1.0
    said = trackmark("results", "list").stdout
    assert "knob.py:Knob on Small: 1, 1 failed" in said
    assert "unfinished, 2 of 5 frames: static/Small/7.unfinished.npy" in said


def test_limits_are_kept_and_their_defaults_are_told(trackmark, here):
    from bench.engine.limits import Limits

    said = " ".join(trackmark("run", "--help").stdout.split())
    assert f"[default: {Limits.frame_seconds:g}]" in said
    assert f"[default: {Limits.run_seconds:g}]" in said
    file = here / "knob.py"
    slower = file.read_text().replace("return", "__import__('time').sleep(0.8)\n        return")
    file.write_text(slower)
    slow = ("run", "--trackers", "knob.py:Knob", "--sequences", "data/Small")
    done = trackmark(*slow, "--run-limit", "2", status=1)
    assert "the run took longer than its limit of 2 s" in done.stdout
    assert "more than 0" in one_line(trackmark(*RUN, "data/Small", "--frame-limit", "0", status=2))
    assert "Did you mean 'dask'" in one_line(
        trackmark(*RUN, "data/Small", "--engine", "dusk", status=2)
    )
    assert "local has none" in one_line(
        trackmark(*RUN, "data/Small", "--address", "tcp://nowhere:1", status=2)
    )


@pytest.mark.parametrize(
    ("text", "size"), [("500MB", 500e6), ("4GiB", 2**32), ("1.5 g", 1.5e9), ("1000", 1000)]
)
def test_a_size_is_read_as_it_is_written(text, size):
    from bench.commands._options import memory_size

    assert memory_size(text) == size


def test_a_report_of_failed_timing_runs_alone_is_written(trackmark, here):
    file = here / "knob.py"
    file.write_text(file.read_text().replace("return Estimate", "raise ValueError  #"))
    chosen = ("--trackers", "knob.py:Knob", "--sequences", "data/Small", "--timing")
    trackmark("run", *chosen, status=1)
    said = trackmark("report", "results/adhoc", "--folder", "report").stdout
    assert "1 of 1 failed" in said
