"""Names, files, terminals and signals that mean no good: a line and a status, no traceback."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from trackmark import bench

SMALL = ("--sequences", "data/Small")
KNOB = ("run", "--name", "mine", "--trackers", "static,knob.py:Knob", *SMALL, "--seeds", 3)
LONG = "x" * 5000
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
    complaint = "trackmark: the output can't be written: No space left on device."
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


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", LONG),
        ("run", f"{LONG}.toml"),
        ("run", "--trackers", "static", "--sequences", LONG),
        ("run", "--trackers", "static", "--sequences", f"{LONG}/*"),
        ("run", "--trackers", LONG, *SMALL),
        ("run", "--trackers", f"{LONG}.py:Class", *SMALL),
        ("run", "--trackers", "static", *SMALL, "--name", LONG),
        ("run", "--trackers", "static", *SMALL, "--output", LONG),
        ("describe", LONG),
        ("show", LONG, "--output", "shown.png"),
        ("show", "data/Small", "--output", f"{LONG}.png"),
        ("show", "data/Small", "--output", "shown.png", "--results", LONG),
        ("annotate", "data/Small/img", "--box", "0:1,1,9,9", "--box", "4:1,1,9,9", "--output")
        + (f"{LONG}.csv",),
        ("report", LONG),
        ("reproduce", LONG),
        ("results", "list", LONG),
        ("results", "check", LONG),
        ("results", "merge", "data", LONG),
    ],
    ids=lambda arguments: " ".join(arguments).replace(LONG, "LONG"),
)
def test_a_name_of_5000_characters_is_a_line_that_fits_a_terminal(trackmark, one_line, arguments):
    line = one_line(trackmark(*arguments, status=2))
    assert line.startswith("trackmark: ")
    assert len(line) < 1000


@pytest.mark.parametrize("option", ["--truth", "--keys", "--published"])
def test_so_it_is_where_click_looks_for_the_file(trackmark, option):
    command = {"--truth": "describe", "--keys": "annotate", "--published": "compare"}[option]
    said = trackmark(command, "data", option, LONG, status=2).stderr
    assert "does not exist" in said
    assert max(map(len, said.splitlines())) < 1000


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("trackers = " + "[" * 5000, "nested too deeply"),
        ("trackers = " + "{a=" * 5000, "nested too deeply"),
        ("trackers = '" + LONG, "Expected"),
        (
            'version = 1\ntrackers = ["knob.py:Knob"]\nsequences = ["data/Small"]\n'
            "repetitions = 1000000000000",
            "an experiment has at most 1000000",
        ),
    ],
    ids=["nested lists", "nested tables", "long line", "repetitions"],
)
def test_an_experiment_that_asks_too_much_is_a_line(trackmark, one_line, here, content, words):
    (here / "trial.toml").write_text(content)
    line = one_line(trackmark("run", "trial.toml", status=2))
    assert words in line
    assert len(line) < 1000


def test_so_are_too_many_seeds(trackmark, one_line):
    line = one_line(trackmark(*KNOB[:-1], 10**12, status=2))
    assert "1000000000001 runs are requested" in line


def test_an_experiment_may_begin_with_the_mark_of_windows(trackmark, here):
    text = 'version = 1\ntrackers = ["static"]\nsequences = ["data/Small"]\n'
    (here / "trial.toml").write_text(text, encoding="utf-8-sig")
    assert "1 of 1 runs" in trackmark("run", "trial.toml").stdout
