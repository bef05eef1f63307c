"""Hostile names, texts, numbers, outputs and signals: no traceback, and the work continues."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

import trackmark as tm
from tests.bench.conftest import messages

SMALL = ("--sequences", "data/Small")
BOTH = ("--sequences", "data/Small,data/Other")
KNOB = ("run", "--name", "mine", "--trackers", "static,knob.py:Knob", *SMALL, "--repetitions", 3)
FULL = Path("/dev/full")
RED = "\x1b[31mred\x07\x9b\u202e"


@pytest.fixture
def two(workspace, otb):
    otb(workspace / "data" / "Other", 5)


def test_closed_pipe_ends_the_output_and_not_the_work(trackmark, workspace, monkeypatch):
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w", buffering=1) as pipe:
        monkeypatch.setattr(sys, "stdout", pipe)
        errors = messages(trackmark(*KNOB, "--json"))
    assert errors == ["4 of 4 runs are in results/mine."]
    assert len(tm.load_runs(workspace / "results").table) == 4


@pytest.mark.slow
@pytest.mark.skipif(not FULL.exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("options", [(), ("--json",)])
def test_full_disk_is_one_message_and_the_work_continues(
    trackmark, workspace, monkeypatch, options
):
    with FULL.open("w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        lines = messages(trackmark(*KNOB, *options, status=2))
    message = "trackmark: the output cannot be written: No space left on device."
    assert lines[0] == message
    assert len(lines) == 1 + bool(options)  # --json prints the folder on standard error
    assert len(tm.load_runs(workspace / "results").table) == 4


INTERRUPTED = """
import os, signal, sys

# A shell's background job ignores Ctrl-C, and so do the processes that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)

MODULE = sys.argv.pop()

class Finder:
    def find_spec(self, name, *_):
        if name == MODULE:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
sys.argv[:] = ["/usr/bin/trackmark", "describe", "samples/face"]
from trackmark.bench.command_line import main
main()
"""


@pytest.mark.parametrize(
    "module",
    ["trackmark", "click", "trackmark.bench.commands.describe"],
)
def test_ctrl_c_during_an_import_gives_no_traceback(module):
    code = [sys.executable, "-c", INTERRUPTED, module]
    done = subprocess.run(code, capture_output=True, text=True, check=False)
    assert done.returncode in (-signal.SIGINT, 130)  # ended by the signal, or by exit
    if module == "trackmark":  # before our first line, the message is Python's
        assert done.stderr.strip().endswith("KeyboardInterrupt")
    else:
        assert done.stderr.strip() == ""


def test_ctrl_c_during_runs_prints_how_many_are_stored(trackmark, workspace, monkeypatch):
    from trackmark.bench.execution.executor import Execution

    rows = Execution.rows

    def interrupted(self, progress=None):
        yield next(rows(self, progress))
        raise KeyboardInterrupt

    monkeypatch.setattr(Execution, "rows", interrupted)
    for command in (KNOB, ("compare", "static", "knob.py:Knob", *SMALL, "--name", "compared")):
        message = trackmark(*command, status=130).stderr.splitlines()[-1]
        assert message.startswith("Stopped: ")
        assert message.endswith(" The same command continues from there.")
        assert f"runs are in results/{command[command.index('--name') + 1]}" in message


def test_control_characters_do_not_reach_the_terminal(trackmark, break_tracker, otb, workspace):
    break_tracker(f"raise ValueError({RED!r} + chr(10) + 'second line')")
    otb(workspace / "data" / f"{RED}\nline", 3)
    run = ("run", "--trackers", "knob.py:Knob", "--sequences", f"data/{RED}\nline")
    table = trackmark(*run, status=1)
    failures = trackmark("results", "failures")
    files = trackmark("report", "results", "--output", "report", "--no-pictures", status=1)
    outputs = (table, failures, files)
    texts = [text for done in outputs for text in (done.stdout, done.stderr)]
    texts += [file.read_text() for file in (workspace / "report").iterdir()]
    for text in texts:
        assert not {*RED} & {*text} - {*"[31mred"}
    assert "ValueError: \\u001b[31mred\\u0007\\u009b\\u202e" in table.stdout
    assert "red\\u0007\\u009b\\u202e\\u000aline" in table.stdout
    assert "\\u001b[31mred" in failures.stdout
    (row,) = trackmark(*run, "--json", status=1).stdout.splitlines()
    assert RED in json.loads(row)["failure"]


@pytest.mark.slow
def test_files_of_check_hold_any_text_or_refuse_it(trackmark, workspace, break_tracker):
    trackmark("baseline", "own", "--trackers", "knob.py:Knob", *SMALL, "--repetitions", 6)
    file = workspace / "baselines" / "own.toml"
    before = file.read_bytes()
    accept = ("check", "own", "--accept", "knob.py:Knob", "--reason")
    message = trackmark(*accept, "\udcff", status=2).stderr
    assert "--reason" in message
    assert "not UTF-8" in message
    assert file.read_bytes() == before
    trackmark(*accept, "delete \x7f and escape \x1b")
    trackmark("check", "own")
    (workspace / "loop").symlink_to("loop")
    for option, path in (
        ("--junit", "knob.py/out"),
        ("--markdown", "x" * 300),
        ("--junit", "loop"),
    ):
        message = trackmark("check", "own", option, path, status=2).stderr
        assert f"{path}: cannot write (" in message
    break_tracker("raise ValueError('red' + chr(27) + chr(0) + chr(0xFFFE) + chr(0xD800))")
    files = ("--junit", "check.xml", "--markdown", "check.md")
    trackmark("check", "own", *files, status=1)
    failure, _mean = ElementTree.parse(workspace / "check.xml").iter("failure")
    assert "red\\u001b\\u0000\\ufffe\\ud800" in failure.get("message")
    assert "ValueError: red" in (workspace / "check.md").read_text()


HUGE = """self.count = getattr(self, "count", 0) + 1
        return Estimate(numpy.array([
            [1e308, 1e308, 1e308, 1e308],
            [-1e308, -1e308, 1e308, 1e308],
            [0.0, 0.0, 1e308, 1e308],
            [1e308, 0.0, 1e-308, 1e308],
        ][self.count % 4]))"""


@pytest.mark.slow
def test_boxes_of_1e308_are_scored_without_a_warning(trackmark, workspace, two):
    file = workspace / "knob.py"
    source = file.read_text()
    update = "return Estimate(self.box + [self.random.random(), 0, 0, 0])"
    assert update in source
    source = source.replace(update, HUGE).replace("from pydantic", "import numpy\nfrom pydantic")
    file.write_text(source)
    # Warnings are errors in tests.
    run = ("run", "--trackers", "static,knob.py:Knob", *BOTH, "--repetitions", 1, "--name")
    assert "4 of 4 runs" in trackmark(*run, "ours").stdout
    presets = "native,otb,lasot,got10k,trackingnet,long-term"
    trackmark("report", "results/ours", "--metrics", presets, "--output", "report")
    assert "static" in trackmark("compare", "--results", "results/ours").stdout
    trackmark(*run, "anchors", "--protocol", "anchors")
    trackmark("report", "results/anchors", "--metrics", "vot-anchor", "--format", "text")
    trackmark("show", "data/Small", "--results", "results/ours", "--output", "shown.mp4")


def test_image_that_is_a_loop_of_links_is_one_message(trackmark, one_line, workspace):
    image = workspace / "data" / "Small" / "img" / "0003.png"
    image.unlink()
    image.symlink_to("0003.png")
    assert "0003.png" in one_line(trackmark("run", "--trackers", "static", *SMALL, status=2))


def test_live_page_may_have_a_name_that_is_not_utf8(trackmark, workspace):
    trackmark("show", "data/Small", "--live", "static", "--output", "\udcff.html")
    assert "%FF" in (workspace / "\udcff.html").read_text()
