"""Hostile names, texts, numbers, files and signals: a message, without a traceback."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from trackmark import bench

SMALL = ("--sequences", "data/Small")
BOTH = ("--sequences", "data/Small,data/Other")
KNOB = ("run", "--name", "mine", "--trackers", "static,knob.py:Knob", *SMALL, "--seeds", 3)
FULL = Path("/dev/full")
RED = "\x1b[31mred\x07\x9b\u202e"


@pytest.fixture
def written_to(monkeypatch):
    """Have standard output be something else."""

    def change(stream):
        monkeypatch.setattr(sys, "stdout", stream)

    return change


def test_a_reader_that_goes_away_ends_the_output_and_not_the_work(trackmark, written_to, here):
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w", buffering=1) as pipe:
        written_to(pipe)
        said = trackmark(*KNOB, "--json").stderr
    assert said == "4 of 4 runs are in results/mine.\n"
    assert len(bench.load_results(here / "results")) == 4


@pytest.mark.skipif(not FULL.exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("more", [(), ("--json",)])
def test_a_full_disk_under_the_output_is_a_line_and_the_work_goes_on(
    trackmark, written_to, here, more
):
    with FULL.open("w") as full:
        written_to(full)
        said = trackmark(*KNOB, *more, status=2).stderr
    complaint = "trackmark: the output cannot be written: No space left on device."
    assert said.splitlines()[0] == complaint
    assert said.count("\n") == 1 + bool(more)  # with --json the folder is told there, too
    assert len(bench.load_results(here / "results")) == 4


INTERRUPTED = """
import os, signal, sys

# A shell's background job ignores Ctrl-C, and so do those that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)

class Finder:
    def find_spec(self, name, *_):
        if name == sys.argv[-1]:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
sys.argv[:-1] = ["/usr/bin/trackmark", "describe"]
from trackmark.bench import cli
cli.main(["describe", "samples/face"])
"""


def interrupted(module):
    code = [sys.executable, "-c", INTERRUPTED, module]
    return subprocess.run(code, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "module",
    [
        "trackmark.bench",
        "click",
        "trackmark.bench.commands",
        "trackmark.bench.commands.describe",
        "numpy",
    ],
)
def test_ctrl_c_is_no_traceback_however_early(module):
    """While a module is imported, each of the command's that takes long."""
    done = interrupted(module)
    assert done.returncode in (-signal.SIGINT, 130)  # died of it, or said so
    assert done.stderr.strip() == ""


def test_ctrl_c_before_our_first_line_is_pythons():
    done = interrupted("trackmark")
    assert done.returncode in (-signal.SIGINT, 130)
    assert done.stderr.strip().endswith("KeyboardInterrupt")


def test_control_characters_of_a_tracker_and_of_a_name_do_not_reach_the_terminal(
    trackmark, spoil, otb, here
):
    spoil(f"raise ValueError({RED!r} + chr(10) + 'second line')")
    otb(here / "data" / f"{RED}\nline", 3)
    run = ("run", "--trackers", "knob.py:Knob", "--sequences", f"data/{RED}\nline")
    shown = trackmark(*run, status=1)
    told = trackmark("results", "failures")
    log = trackmark("results", "log")
    files = trackmark("report", "results", "--folder", "report", "--no-pictures", status=1)
    texts = [text for done in (shown, told, log, files) for text in (done.stdout, done.stderr)]
    texts += [file.read_text() for file in (here / "report").iterdir()]
    for text in texts:
        assert not {*RED} & {*text} - {*"[31mred"}
    assert "ValueError: \\u001b[31mred\\u0007\\u009b\\u202e" in shown.stdout
    assert "red\\u0007\\u009b\\u202e\\u000aline" in shown.stdout
    assert "second line" in told.stdout
    (row,) = trackmark(*run, "--json", status=1).stdout.splitlines()
    assert RED in json.loads(row)["failure"]


def test_an_experiment_may_begin_with_the_mark_of_windows(trackmark, here):
    text = 'version = 1\ntrackers = ["static"]\nsequences = ["data/Small"]\n'
    (here / "trial.toml").write_text(text, encoding="utf-8-sig")
    assert "1 of 1 runs" in trackmark("run", "trial.toml").stdout


@pytest.fixture
def two(here, otb):
    otb(here / "data" / "Other", 5)


def test_check_junit_escapes_what_xml_cannot_hold(trackmark, here, spoil):
    trackmark("baseline", "own", "--trackers", "knob.py:Knob", *SMALL)
    spoil("raise ValueError('red' + chr(27) + chr(0) + chr(0xFFFE) + chr(0xD800))")
    files = ("--junit", "check.xml", "--markdown", "check.md")
    trackmark("check", "own", *files, status=1)
    failure, _mean = ElementTree.parse(here / "check.xml").iter("failure")
    assert "red\\u001b\\u0000\\ufffe\\ud800" in failure.get("message")
    assert "ValueError: red" in (here / "check.md").read_text()


def test_check_because_rejects_text_that_is_not_utf8(trackmark, here):
    trackmark("baseline", "own", "--trackers", "static", *SMALL)
    before = (here / "baselines" / "own.toml").read_bytes()
    accept = ("check", "own", "--accept", "static", "--because")
    message = trackmark(*accept, "\udcff", status=2).stderr
    assert "--because" in message
    assert "not UTF-8" in message
    assert (here / "baselines" / "own.toml").read_bytes() == before
    trackmark(*accept, "delete \x7f and escape \x1b")
    trackmark("check", "own")


@pytest.mark.parametrize("name", ["NA", "nan", "None", "null"])
def test_compare_published_accepts_a_tracker_named_na(trackmark, here, two, name):
    trackmark("run", "--trackers", "static", *BOTH, "--name", "ours")
    rows = f"tracker,sequence,mean_overlap\n{name},Small,0.5\n{name},Other,0.6\n"
    (here / "published.csv").write_text(rows)
    compared = trackmark("compare", "--results", "results/ours", "--published", "published.csv")
    assert f"{name} (published)" in compared.stdout


HUGE = """self.count = getattr(self, "count", 0) + 1
        return Estimate(numpy.array([
            [1e308, 1e308, 1e308, 1e308],
            [-1e308, -1e308, 1e308, 1e308],
            [0.0, 0.0, 1e308, 1e308],
            [1e308, 0.0, 1e-308, 1e308],
        ][self.count % 4]))"""


def test_boxes_of_1e308_are_scored_without_a_warning(trackmark, here, two):
    file = here / "knob.py"
    source = file.read_text()
    act = "return Estimate(self.box + [self.random.random(), 0, 0, 0])"
    assert act in source
    file.write_text(
        source.replace(act, HUGE).replace("from pydantic", "import numpy\nfrom pydantic")
    )
    # Warnings are errors in tests.
    command = ("run", "--trackers", "static,knob.py:Knob", *BOTH, "--name", "ours")
    assert "4 of 4 runs" in trackmark(*command, "--seeds", 1).stdout
    presets = "native,otb,lasot,got10k,trackingnet,long-term"
    trackmark("report", "results/ours", "--metrics", presets, "--folder", "report")
    compared = trackmark("compare", "--results", "results/ours")
    anchors = (*command[:-1], "anchors", "--protocol", "anchors", "--seeds", 1)
    trackmark(*anchors)
    trackmark("report", "results/anchors", "--metrics", "vot-anchor", "--format", "text")
    trackmark("show", "data/Small", "--results", "results/ours", "--output", "shown.mp4")
    assert "static" in compared.stdout


def test_a_loop_among_the_images_is_one_line(trackmark, one_line, here):
    image = here / "data" / "Small" / "img" / "0003.png"
    image.unlink()
    image.symlink_to("0003.png")
    line = one_line(trackmark("run", "--trackers", "static", *SMALL, status=2))
    assert "0003.png" in line


@pytest.mark.parametrize("option", ["--junit", "--markdown"])
@pytest.mark.parametrize("place", ["knob.py/out", "x" * 300, "loop"])
def test_check_names_the_file_that_it_cannot_write(trackmark, here, option, place):
    (here / "loop").symlink_to("loop")
    trackmark("baseline", "own", "--trackers", "static", *SMALL)
    message = trackmark("check", "own", option, place, status=2).stderr
    assert f"{place}: cannot write (" in message


def test_compare_folder_names_the_file_it_cannot_write(trackmark, here, two):
    trackmark("run", "--trackers", "static,knob.py:Knob", *BOTH, "--name", "ours")
    command = ("compare", "--results", "results/ours", "--folder", "knob.py/out")
    message = trackmark(*command, status=2).stderr
    assert "knob.py/out/comparison.txt: cannot write (Not a directory)." in message


def test_a_live_page_may_have_a_name_that_is_not_utf8(trackmark, here):
    trackmark("show", "data/Small", "--live", "static", "--output", "\udcff.html")
    assert "%FF" in (here / "\udcff.html").read_text()
