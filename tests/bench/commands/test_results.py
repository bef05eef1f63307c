"""`trackmark results`, `report`, `show`: stored runs listed, told, merged, tabled and drawn."""

import json
import shutil

import cv2
import pytest

from trackmark import bench

SMALL = ("--sequences", "data/Small")
MINE = ("run", "--name", "mine", "--trackers")
STATIC = (*MINE, "static", "--sequences")
KNOB = (*MINE, "static,knob.py:Knob", *SMALL)


def rows(done):
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_results_are_listed_merged_and_removed(trackmark, here):
    trackmark(*STATIC, "data/Small", "--name", "a")
    trackmark("run", "--trackers", "camshift", *SMALL, "--name", "b")
    assert "static on Small: 1" in trackmark("results", "list").stdout
    merged = trackmark("results", "merge", "results/a", "results/b", "results/c").stdout
    assert "Copied 2 runs" in merged
    assert "Copied 0 runs" in trackmark("results", "merge", "results/a", "results/c").stdout
    assert len(bench.load_results(here / "results" / "c")) == 2
    removed = trackmark("results", "remove", "results/c", "--tracker", "cam*", "--yes")
    assert "Removed 1 runs" in removed.stdout
    left = rows(trackmark("results", "list", "results/c", "--json"))
    assert [row["tracker"] for row in left] == ["static"]
    nothing = trackmark("results", "remove", "results/c", "--failed", "--yes").stdout
    assert nothing == "No run matches; nothing was removed.\n"


def test_merging_runs_that_differ_is_refused_and_copies_nothing(trackmark, here):
    trackmark("run", "--trackers", "knob.py:Knob", *SMALL, "--name", "a")
    with (here / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    trackmark(*KNOB, "--name", "b")
    done = trackmark("results", "merge", "results/b", "results/a", status=1)
    assert "conflict: knob.py" in done.stderr
    assert bench.load_results(here / "results" / "a")["tracker"].tolist() == ["knob.py:Knob"]


def test_merging_different_data_of_one_name_is_refused(trackmark, here, otb):
    for number, name in enumerate("ab"):
        otb(here / name / "clip", 4 + number)
        trackmark(*STATIC, f"{name}/clip", "--name", name)
    trackmark("run", "--trackers", "camshift", "--sequences", "a/clip", "--name", "c")
    assert "Copied 2 runs" in trackmark("results", "merge", "results/a", "results/c", "all").stdout
    said = trackmark("results", "merge", "results/c", "results/b", "both", status=1).stderr
    assert str(here / "a" / "clip") in said
    assert str(here / "b" / "clip") in said
    assert not (here / "both").exists()


def test_a_log_tells_what_was_done_and_who_failed(trackmark, one_line, here, spoil):
    spoil()
    trackmark(*KNOB, status=1)
    said = trackmark("results", "log").stdout
    assert "start of mine: 2 runs (0 done, 0 failed, 0 stale, 2 left)" in said
    assert "failed: knob.py:Knob, repetition 0: 0002.png: ValueError: no idea" in said
    assert "finished after" in said
    events = rows(trackmark("results", "log", "--json"))
    units = [event for event in events if event["event"] == "unit"]
    assert [event["event"] for event in events] == ["start", *["unit"] * len(units), "end"]
    assert sum(len(runs) for unit in units for runs in unit["runs"].values()) == 2
    for unit in units:
        assert unit["peak_memory"] > 1e6
        assert unit["seconds"] > 0
    file = here / "results" / "mine" / "runs.db"
    file.write_bytes(file.read_bytes().replace(b'"peak_memory"', b'"leak_memory"'))
    assert "is damaged" in one_line(trackmark("results", "log", status=2))


def test_results_that_failed_are_listed(trackmark, spoil):
    spoil()
    trackmark(*KNOB, status=1)
    assert "knob.py:Knob on Small: 1, 1 failed" in trackmark("results", "list").stdout


def test_report_writes_tables_in_every_format_and_plots(trackmark, here):
    trackers = "static,camshift,knob.py:Knob"
    trackmark(*MINE, trackers, *SMALL)
    done = trackmark("report", "results/mine", "--folder", "report", "--format", "svg")
    said, (page, beside) = done.stdout, done.stderr.splitlines()[-2:]
    assert page == "report/report.html"
    drawn = "5 pictures (.svg), 5 pictures (.pdf), 1 picture (.png), report.md, report.tex."
    assert beside == f"Beside it: 7 tables as .txt, .md, .csv and .tex, {drawn}"
    suffixes = {file.suffix for file in (here / "report").rglob("*") if file.is_file()}
    assert {".txt", ".md", ".csv", ".tex", ".svg", ".html"} <= suffixes
    assert {file.stem for file in (here / "report").glob("*.png")} == {"strip-Small"}
    drawn = {file.stem for file in (here / "report").glob("*.svg")}
    assert {"success", "precision", "frames-Small", "survival", "heat"} <= drawn
    assert "](success.svg)" in (here / "report" / "report.md").read_text()
    assert "camshift" in said
    markdown = trackmark("report", "results/mine", "--format", "markdown").stdout
    assert markdown.count("|") > 10


def test_a_report_leaves_its_page_with_the_results_unless_it_prints_for_a_script(trackmark, here):
    trackmark(*STATIC, "data/Small")
    page = here / "results" / "mine" / "report.html"
    for options in (["--json"], ["--format", "csv"], ["--no-pictures"]):
        trackmark("report", "results", *options)
        assert not page.exists()
    for options in (["--format", "pdf"], ["--json", "--frames"], ["--no-pictures", "--frames"]):
        assert "--folder" in trackmark("report", "results", *options, status=2).stderr
    done = trackmark("report", "results", "--frames")
    assert done.stderr.splitlines()[-1] == "results/mine/report.html"
    assert (page.parent / "report-frames" / "full-0-0.js").is_file()
    assert "report.html" not in trackmark("results", "list").stdout
    trackmark("results", "check", "results")


def test_a_report_on_several_experiments_names_each(trackmark, here):
    (here / "trial.toml").write_text(
        'version = 1\ntitle = "Mine"\nsequences = ["data/Small"]\ntrackers = ["static"]\n'
    )
    for name in "ab":
        trackmark("run", "trial.toml", "--name", name)
    said = trackmark("report", "results").stdout
    assert "a: Mine: every sequence" in said
    assert "b: Mine: every sequence" in said
    assert trackmark("report", "results/a").stdout.startswith("Mine: every sequence")


def test_a_report_of_tables_alone_opens_no_sequence_and_no_run(trackmark, monkeypatch, here):
    trackmark(*STATIC, "data/Small,samples/face")
    monkeypatch.setattr(
        "trackmark.datasets.load", lambda *_, **__: pytest.fail("a sequence was opened")
    )
    monkeypatch.setattr(
        "trackmark.bench.store.results.Results.read", lambda *_: pytest.fail("a run was opened")
    )
    trackmark("report", "results/mine", "--folder", "report", "--no-pictures")
    assert {file.suffix for file in (here / "report").iterdir()} == {".txt", ".md", ".csv", ".tex"}


def test_a_report_draws_strips_of_recorded_data_and_only_while_they_are_the_same(
    trackmark, one_line, here, monkeypatch
):
    for name in ("a|b", "a-b"):
        shutil.copytree(here / "data" / "Small", here / "data" / name)
    trackmark(*STATIC, "data/Small,samples/face,data/a|b,data/a-b")
    trackmark("report", "results/mine", "--folder", "first")
    assert len(list((here / "first").glob("strip-a-b-*.png"))) == 2
    assert len(list((here / "first").glob("frames-a-b-*.png"))) == 2
    assert (here / "first" / "strip-Small.png").is_file()
    assert (here / "first" / "strip-samples-face.png").is_file()
    truth = here / "data" / "Small" / "groundtruth_rect.txt"
    truth.write_text(truth.read_text().replace("5,6,10,12", "5,6,10,13", 1))
    monkeypatch.setattr(
        "trackmark.bench.reporting.pictures.write_plots", lambda *_, **__: []
    )  # as before
    said = trackmark("report", "results/mine", "--folder", "second").stderr
    assert "Small: no film strip" in said
    assert not (here / "second" / "strip-Small.png").exists()
    done = trackmark("show", "data/Small", "--results", "results", "--output", "a.png", status=2)
    assert "another version" in one_line(done)


def test_a_report_of_failed_timing_runs_alone_is_written(trackmark, spoil):
    spoil()
    trackmark(*MINE, "knob.py:Knob", *SMALL, "--timing", status=1)
    said = trackmark("report", "results/mine", "--folder", "report", status=1).stdout
    assert "1 of 1 failed" in said


def test_report_exits_with_1_if_every_run_of_a_tracker_failed(trackmark, spoil):
    trackmark(*MINE, "knob.py:Knob", *SMALL)
    assert not trackmark("report", "results/mine", "--no-pictures").stderr
    spoil()
    trackmark(*MINE, "knob.py:Knob", *SMALL, status=1)
    done = trackmark("report", "results/mine", "--no-pictures", status=1)
    line = "knob.py:Knob: 1 of 1 runs failed (left out): sequence Small, ValueError: no idea"
    assert line in done.stdout
    assert line in done.stderr


def test_report_names_trackers_that_are_not_repeatable(trackmark, spoil):
    spoil("self.box = self.box + __import__('os').urandom(4)[0] / 99; return Estimate(self.box)")
    trackmark(*MINE, "knob.py:Knob,static", *SMALL)
    trackmark(*MINE, "knob.py:Knob,static", *SMALL, "--timing")
    said = trackmark("report", "results/mine", "--no-pictures").stdout
    assert "knob.py:Knob is not repeatable: seed 0 gave other boxes on Small" in said.replace(
        "\n", " "
    )
    assert "static is not" not in said


def test_show_makes_a_film_strip_and_an_h264_video(trackmark, here):
    import av

    trackmark(*STATIC, "samples/face")
    shown = ("show", "samples/face", "--results", "results/mine", "--output")
    trackmark(*shown, "strip.png")
    assert cv2.imread(str(here / "strip.png")).shape[1] > 800
    trackmark(*shown, "video.mp4", "--last", 29)
    with av.open(str(here / "video.mp4")) as video:
        assert video.streams.video[0].codec_context.name == "h264"
        assert sum(1 for _ in video.decode(video=0)) == 30


def test_show_never_overwrites_what_it_shows(trackmark, here):
    trackmark("show", "data/Small/img", "--output", "mine.mp4")
    whole = (here / "mine.mp4").read_bytes()
    assert "overwritten" in trackmark("show", "mine.mp4", "--output", "mine.mp4", status=2).stderr
    assert (here / "mine.mp4").read_bytes() == whole
    image = "data/Small/img/0001.png"
    assert "overwritten" in trackmark("show", "data/Small", "--output", image, status=2).stderr
