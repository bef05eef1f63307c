"""`trackmark results`, `report` and `show`: stored runs listed, merged, tabled and drawn."""

import re
import shutil
import sqlite3
from contextlib import closing

import av
import cv2
import numpy as np
import pandas as pd
import pytest

import trackmark as tm
from tests.bench.commands.conftest import SMALL, json_lines
from tests.bench.store.test_durability import drop_last_entry_of_index

pytestmark = pytest.mark.usefixtures("blank_figures")

MINE = ("run", "--name", "mine", "--trackers")
STATIC = (*MINE, "static", "--sequences")
KNOB = (*MINE, "static,knob.py:Knob", *SMALL)


def test_results_are_listed_merged_and_removed(trackmark, workspace):
    trackmark(*STATIC, "data/Small", "--name", "a")
    trackmark("run", "--trackers", "camshift", *SMALL, "--name", "b")
    assert "static on Small: 1" in trackmark("results", "list").stdout
    merged = trackmark("results", "merge", "results/a", "results/b", "results/c").stdout
    assert "Copied 2 runs" in merged
    assert "Copied 0 runs" in trackmark("results", "merge", "results/a", "results/c").stdout
    assert len(tm.load_runs(workspace / "results" / "c").table) == 2
    removed = trackmark("results", "remove", "results/c", "--tracker", "cam*", "--yes")
    assert "Removed 1 run." in removed.stdout
    left = json_lines(trackmark("results", "list", "results/c", "--json"))
    assert [row["tracker"] for row in left] == ["static"]
    nothing = trackmark("results", "remove", "results/c", "--failed", "--yes").stdout
    assert nothing == "No run matches; nothing was removed.\n"


@pytest.mark.slow
def test_merge_refuses_runs_of_other_versions_and_other_data(trackmark, workspace, otb):
    trackmark("run", "--trackers", "knob.py:Knob", *SMALL, "--name", "old")
    with (workspace / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    trackmark(*KNOB, "--name", "new")
    done = trackmark("results", "merge", "results/new", "results/old", status=1)
    assert "conflict: knob.py" in done.stderr
    assert tm.load_runs(workspace / "results" / "old").table["tracker"].tolist() == ["knob.py:Knob"]
    for number, name in enumerate("ab"):
        otb(workspace / name / "clip", 4 + number)
        trackmark(*STATIC, f"{name}/clip", "--name", name)
    trackmark("run", "--trackers", "camshift", "--sequences", "a/clip", "--name", "c")
    assert "Copied 2 runs" in trackmark("results", "merge", "results/a", "results/c", "all").stdout
    message = trackmark("results", "merge", "results/c", "results/b", "both", status=1).stderr
    assert str(workspace / "a" / "clip") in message
    assert str(workspace / "b" / "clip") in message
    assert not (workspace / "both").exists()


@pytest.mark.slow
def test_failures_are_listed_by_their_first_line(trackmark, break_tracker):
    break_tracker()
    trackmark(*KNOB, status=1)
    assert "knob.py:Knob on Small: 1, 1 failed" in trackmark("results", "list").stdout
    done = trackmark("results", "failures", "results/mine")
    reason, place = done.stdout.splitlines()[1:]
    assert reason == "  0002.png: ValueError: no idea"
    assert re.fullmatch(r"  knob\.py, line \d+, in update", place)
    whole = trackmark("results", "failures", "results/mine", "--verbose").stdout
    assert "Traceback (most recent call last)" in whole
    assert "add --verbose" in done.stderr
    (failure,) = json_lines(trackmark("results", "failures", "results/mine", "--json"))
    assert "Traceback" in failure["failure"]


def test_report_writes_tables_in_every_format_and_plots(trackmark, workspace):
    trackmark(*MINE, "static,camshift,knob.py:Knob", *SMALL)
    done = trackmark("report", "results/mine", "--output", "report", "--format", "svg")
    page, others = done.stderr.splitlines()[-2:]
    assert page == "report/report.html"
    tables = ", ".join(f"1 {suffix}" for suffix in (".txt", ".md", ".csv", ".tex"))
    assert others == f"In its folder: {tables}, 4 .svg, 1 .png."
    suffixes = {file.suffix for file in (workspace / "report").rglob("*") if file.is_file()}
    assert {".txt", ".md", ".csv", ".tex", ".svg", ".html"} <= suffixes
    assert {file.stem for file in (workspace / "report").glob("*.png")} == {"strip-Small"}
    figures = {file.stem for file in (workspace / "report").glob("*.svg")}
    assert figures == {"success", "precision", "survival", "speed-accuracy"}
    assert "camshift" in done.stdout
    markdown = trackmark("report", "results/mine", "--format", "markdown").stdout
    assert markdown.partition("\n")[0] in " ".join(done.stdout.split())
    assert markdown.count("|") > 10


def test_report_writes_its_page_unless_it_prints_for_a_script(trackmark, workspace):
    trackmark(*STATIC, "data/Small")
    page = workspace / "results" / "mine" / "report.html"
    for options in (["--json"], ["--no-pictures"]):
        trackmark("report", "results", *options)
        assert not page.exists()
    done = trackmark("report", "results", "--frames")
    assert done.stderr.splitlines()[-1] == "results/mine/report.html"
    assert (page.parent / "report-frames" / "full-0-0.js").is_file()
    assert "report.html" not in trackmark("results", "list").stdout
    trackmark("results", "check", "results")


def test_report_opens_its_page_in_the_browser(trackmark, workspace, monkeypatch):
    trackmark(*STATIC, "data/Small")
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)  # None: there is no browser
    done = trackmark("report", "results/mine", "--open")
    page = workspace / "results" / "mine" / "report.html"
    assert opened == [page.as_uri()]
    assert "No browser was found. Open results/mine/report.html yourself." in done.stderr
    refused = trackmark("report", "results/mine", "--no-pictures", "--open", status=2)
    assert "--open requires a page" in refused.stderr


@pytest.mark.slow
def test_report_on_several_experiments_names_each(trackmark, workspace):
    (workspace / "trial.toml").write_text(
        'version = 1\ntitle = "Mine"\nsequences = ["data/Small"]\ntrackers = ["static"]\n'
    )
    for name in "ab":
        trackmark("run", "trial.toml", "--name", name)
    lines = trackmark("report", "results", "--no-pictures").stdout.splitlines()
    assert [line for line in lines if line.endswith(":")] == ["a: Mine:", "b: Mine:"]
    text = trackmark("report", "results/a", "--no-pictures", "--verbose").stdout
    assert "Mine: every sequence" in text
    assert "a: Mine" not in text


def test_report_of_tables_opens_no_sequence_and_no_run(trackmark, monkeypatch, workspace):
    trackmark(*STATIC, "data/Small")
    for name in ("datasets.load", "bench.store.run_store.RunStore.read"):
        monkeypatch.setattr(f"trackmark.{name}", lambda *_, **__: pytest.fail("it was opened"))
    trackmark("report", "results/mine", "--output", "report", "--no-pictures")
    suffixes = {file.suffix for file in (workspace / "report").iterdir()}
    assert suffixes == {".txt", ".md", ".csv", ".tex"}


@pytest.mark.slow
def test_film_strips_are_drawn_of_unchanged_data_only(trackmark, one_line, workspace, monkeypatch):
    for name in ("a|b", "a-b"):
        shutil.copytree(workspace / "data" / "Small", workspace / "data" / name)
    trackmark(*STATIC, "data/Small,data/a|b,data/a-b")
    trackmark("report", "results/mine", "--output", "first")
    assert len(list((workspace / "first").glob("strip-a-b-*.png"))) == 2
    assert (workspace / "first" / "strip-Small.png").is_file()
    truth = workspace / "data" / "Small" / "groundtruth_rect.txt"
    truth.write_text(truth.read_text().replace("5,6,10,12", "5,6,10,13", 1))
    monkeypatch.setattr("trackmark.bench.pages.report_figures.write_file", lambda file, _: file)
    errors = trackmark("report", "results/mine", "--output", "second").stderr
    assert "no film strip: Small " in errors
    assert not (workspace / "second" / "strip-Small.png").exists()
    done = trackmark("show", "data/Small", "--results", "results", "--output", "a.png", status=2)
    assert "another version" in one_line(done)


@pytest.mark.slow
def test_report_exits_with_1_if_every_run_of_a_tracker_failed(trackmark, break_tracker):
    knob = (*MINE, "knob.py:Knob", *SMALL)
    trackmark(*knob)
    assert not trackmark("report", "results/mine", "--no-pictures").stderr
    break_tracker()
    trackmark(*knob, status=1)
    done = trackmark("report", "results/mine", "--no-pictures", status=1)
    line = "knob.py:Knob: 1 of 1 runs failed (left out): sequence Small, ValueError: no idea"
    assert "1 of 1 run FAILED:" in done.stdout
    assert line in done.stderr
    trackmark(*knob, "--timing", "--name", "timed", status=1)
    report = ("report", "results/timed", "--no-pictures")
    assert "1 of 1 failed" in trackmark(*report, status=1).stdout


@pytest.mark.slow
def test_report_names_trackers_that_are_not_repeatable(trackmark, break_tracker):
    break_tracker("return Estimate(self.box + __import__('os').urandom(4)[0] / 99)")
    trackmark(*KNOB)
    trackmark(*KNOB, "--timing")
    text = " ".join(trackmark("report", "results/mine", "--no-pictures").stderr.split())
    assert "knob.py:Knob is not repeatable: repetition 0 gave other boxes on Small" in text
    assert "static is not" not in text


@pytest.mark.slow
def test_show_draws_a_film_strip_and_an_h264_video(trackmark, workspace):
    trackmark(*STATIC, "samples/face")
    show = ("show", "samples/face", "--results", "results/mine", "--output")
    trackmark(*show, "strip.png")
    assert cv2.imread(str(workspace / "strip.png")).shape[1] > 800
    trackmark(*show, "video.mp4", "--last-frame", 29)
    with av.open(str(workspace / "video.mp4")) as video:
        assert video.streams.video[0].codec_context.name == "h264"
        assert sum(1 for _ in video.decode(video=0)) == 30


def test_show_never_overwrites_its_sequence(trackmark, workspace):
    trackmark("show", "data/Small/img", "--output", "mine.mp4")
    content = (workspace / "mine.mp4").read_bytes()
    for sequence, output in (("mine.mp4", "mine.mp4"), ("data/Small", "data/Small/img/0001.png")):
        message = trackmark("show", sequence, "--output", output, status=2).stderr
        assert "overwritten" in message
    assert (workspace / "mine.mp4").read_bytes() == content


@pytest.mark.slow
def test_report_by_attribute_measures_each_sequence_once(trackmark, workspace, otb):
    for speed in range(12):
        folder = otb(workspace / "twelve" / f"s{speed}", 4)
        boxes = [f"{5 + speed * frame},6,10,12\n" for frame in range(4)]
        (folder / "groundtruth_rect.txt").write_text("".join(boxes))
    trackmark("run", "--trackers", "static,camshift", "--sequences", "twelve", "--name", "twelve")
    report = ("report", "results/twelve", "--by-attribute", "--metrics", "otb")
    first = trackmark(*report, "--output", "paper").stdout
    assert first.count("against attributes of the sequences") == 1
    assert (workspace / "paper" / "attributes-otb.png").is_file()
    assert (workspace / "paper" / "attributes-otb.md").is_file()
    cache = workspace / "cache" / "attributes"
    times = sorted(file.stat().st_mtime_ns for file in cache.iterdir())
    assert len(times) == 12
    assert trackmark(*report, "--no-pictures").stdout == first
    assert sorted(file.stat().st_mtime_ns for file in cache.iterdir()) == times
    frame = pd.read_csv(workspace / "paper" / "attributes-otb.csv")
    assert set(frame["tracker"]) == {"static", "camshift"}
    assert set(frame["bin_sequences"].dropna()) == {6}


def test_report_by_attribute_names_a_missing_sequence(trackmark, workspace, otb):
    folders = [otb(workspace / name, frames) for name, frames in (("one", 4), ("two", 5))]
    trackmark("run", "--trackers", "static", "--sequences", "one,two", "--name", "gone")
    shutil.rmtree(folders[1])
    done = trackmark("report", "results/gone", "--by-attribute", "--no-pictures")
    assert "attributes are unknown" in done.stderr


@pytest.fixture
def two_versions(trackmark, workspace, otb):
    """Store runs of two versions of a tracker: on Small of the older, on Other of the newer one."""
    otb(workspace / "data" / "Other", 5)
    options = ["--trackers", "knob.py,static", "--results-root", ".", "--name", "trial"]
    trackmark("run", *options, "--sequences", "data/Small")
    file = workspace / "knob.py"
    file.write_text(file.read_text().replace("self.random.random()", "2 * self.random.random()"))
    trackmark("run", *options, "--sequences", "data/Other")


def test_runs_of_two_versions_of_a_tracker_are_not_averaged(trackmark, two_versions, workspace):
    note = "stale: knob.py:Knob, 1 by another version of the tracker or the sequence (Small)"
    for form in ("text", "markdown"):
        printed = trackmark("report", "trial", "--format", form).stdout
        assert note in printed.replace("\\", "")
        assert "1 of 2 stale" in printed
    assert note[:60] in trackmark("report", "trial", "--no-pictures").stdout
    results = tm.load_runs("trial")
    assert results.means().loc["knob.py:Knob"].isna().all()
    table = results.table.set_index(["tracker", "sequence"])
    assert table.loc[("knob.py:Knob", "Small"), "status"] == "stale"
    assert np.isnan(table.loc[("knob.py:Knob", "Small"), "mean_overlap"])
    assert "stale" in trackmark("compare", "--results", "trial", status=2).stderr
    assert "knob.py:Knob on Small: 1, 1 stale" in trackmark("results", "list", "trial").stdout
    exported = trackmark("results", "export", "trial", "out", "--as", "otb").stderr
    assert "knob.py:Knob on Small, repetition 0: not exported" in exported
    messages = trackmark("show", "data/Small", "--results", "trial", "--output", "s.png").stderr
    assert "knob.py:Knob, repetition 0: not drawn" in messages
    trackmark("run", "--trackers", "knob.py", *SMALL, "--results-root", ".", "--name", "trial")
    assert "stale" not in trackmark("report", "trial", "--format", "text").stdout


def test_runs_on_two_versions_of_a_sequence_are_not_averaged(trackmark, workspace):
    options = ["--sequences", "data/Small", "--results-root", ".", "--name", "trial"]
    trackmark("run", "--trackers", "static", *options)
    (workspace / "data/Small/groundtruth_rect.txt").write_text("6,6,10,12\n" * 5)
    trackmark("run", "--trackers", "camshift", *options)
    printed = trackmark("report", "trial", "--format", "text").stdout
    assert "stale: static, 1 by another version of the tracker or the sequence (Small)" in printed
    assert "stale" in trackmark("compare", "--results", "trial", status=2).stderr


def test_requested_runs_of_an_older_version_are_shown(trackmark, two_versions, workspace):
    """Runs of the version that is requested now are not stale for this request."""
    file = workspace / "knob.py"
    file.write_text(file.read_text().replace("2 * self.random", "self.random"))
    options = ["--sequences", "data/Small", "--name", "trial", "--results-root", "."]
    printed = trackmark("run", "--trackers", "knob.py,static", *options).stdout
    assert "stale" not in printed
    assert "—" not in printed


@pytest.mark.slow
def test_merge_refuses_two_versions_of_a_tracker(trackmark, two_versions, workspace):
    options = ["--trackers", "knob.py", "--results-root", ".", "--sequences", "data/Other"]
    trackmark("run", *options, "--name", "newer")
    trackmark("results", "remove", "trial", "--sequence", "Other", "--yes")
    refused = trackmark("results", "merge", "newer", "trial", "both", status=1).stderr
    assert "the versions of knob.py:Knob differ between newer and trial" in refused


def edit_database(folder, statement):
    with closing(sqlite3.connect(folder / "runs.db")) as database:
        database.execute(statement)
        database.commit()


def test_check_does_not_call_a_newer_schema_damaged(trackmark, workspace):
    trackmark(*STATIC, "data/Small", "--results-root", "results")
    shutil.copytree("results/mine", "results/newer")
    edit_database(workspace / "results/newer", "PRAGMA user_version = 9")
    checked = trackmark("results", "check", "results", status=2)
    assert "results/mine: 1 runs, undamaged\n" in checked.stdout
    assert "results/newer: not checked\n" in checked.stdout
    assert "schema version 9" in checked.stderr
    assert "damage" not in checked.stderr
    (_, newer) = json_lines(trackmark("results", "check", "results", "--json", status=2))
    assert newer["damages"] == []
    assert "schema version 9" in newer["error"]


def test_check_names_a_damaged_index_and_an_empty_file(trackmark, workspace):
    trackmark(*STATIC, "data/Small", "--results-root", "results")
    drop_last_entry_of_index(workspace / "results/mine")
    checked = trackmark("results", "check", "results", status=1)
    assert "results/mine: damaged\n" in checked.stdout
    assert "`trackmark results merge`" in checked.stderr
    (workspace / "results/mine/runs.db").write_bytes(b"")
    checked = trackmark("results", "check", "results", status=1)
    assert "results/mine: damaged\n" in checked.stdout
    assert "it has 0 bytes" in checked.stderr


def test_timing_runs_are_removed_by_their_protocol(trackmark, workspace):
    run = ("run", "--trackers", "static", "--sequences", "data/Small", "--name", "mine")
    trackmark(*run)
    trackmark(*run, "--timing")
    remove = ("results", "remove", "results/mine", "--yes", "--protocol")
    assert "unknown protocol 'timings'" in trackmark(*remove, "timings", status=2).stderr
    assert trackmark(*remove, "timing").stdout == "Removed 1 run.\n"
    table = tm.load_runs(workspace / "results").table
    assert table["protocol"].tolist() == ["one-pass"]
