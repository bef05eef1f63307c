"""Trackers from outside the package: their files are imported in processes of their own."""

import sys
import threading
from pathlib import Path

import pytest

from trackmark import trackers
from trackmark.bench.experiments.tracker_spec import (
    describe_tracker,
    resolve_specs,
    tracker_version,
)
from trackmark.bench.external.isolated_worker import IsolatedTrackers
from trackmark.trackers import TrackerError

CALM = """
from trackmark.trackers import Estimate, TrackerPlugin

class Calm(TrackerPlugin):
    \"\"\"Stays.\"\"\"

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        return Estimate(self.box)
"""
UNPRINTABLE = """class Error(Exception):
    def __str__(self):
        raise ValueError
raise Error"""

REFUSED = {  # code before the class, code in or after it, words of the error
    "exits": ("import sys; sys.exit(0)", "", "the file cannot be imported: SystemExit: 0 (line 1)"),
    "no syntax": ("\nclass:", "", "SyntaxError: invalid syntax (line 2)"),
    "raises": ("raise RuntimeError('no\\nlicence')", "", "RuntimeError: no licence (line 1)"),
    "lacks a library": ("import a_missing_library", "", "No module named 'a_missing_library'"),
    "interrupts": ("raise KeyboardInterrupt", "", "its description raises KeyboardInterrupt"),
    "can't be printed": (UNPRINTABLE, "", "<exception str() failed>"),
    "presets of no kind": ("", "    presets = 5", "`presets` must be a dict of parameter values"),
    "a preset of nothing": ("", "    presets = {'recommended': {'a': 5}}", "unknown parameter of"),
    "parameters of no kind": ("", "    Parameters = int", "a class derived from trackers.Par"),
    "randomness in words": ("", "    randomness = 'none'", "must be a member of trackers.Random"),
    "no update": ("", "    update = TrackerPlugin.update", "it lacks update"),
    "called like another": ("", "    name = 'static'", "name 'static' belongs to another tracker"),
    "called like a folder": ("", "    name = '../x'", "'../x' is not a valid name of a tracker"),
    "two of them": (
        "",
        "class Other(Calm):\n    pass",
        "the file defines several trackers: Calm, Other. Select one",
    ),
    "none of them": (
        "",
        "del Calm",
        "the file defines no tracker. Expected: a class with the methods init(image, box)",
    ),
}
TAKEN = {
    "prints": "print('hello')",
    "writes": "import os; os.write(1, b'hello'); os.write(2, b'hello')",
    "goes elsewhere": "import os; os.chdir('/')",
    "closes its output": "import sys; sys.stdout.close(); sys.stderr.close()",
    "leaves a thread": "import threading\nthreading.Thread(target=threading.Event().wait).start()",
}
ENDS = {
    "import os; os._exit(0)": "the process ended with status 0",
    "import os; os.kill(os.getpid(), 9)": "the process ended by signal 9",
}


@pytest.fixture
def calm(tmp_path):
    """Write a file with a tracker: code before the class, and code within or after the class."""

    def write(name, before="", after=""):
        file = tmp_path / f"{name.replace(' ', '-')}.py"
        file.write_text(f"{before}\n{CALM}\n{after}\n")
        return file

    return write


def test_error_of_an_import_is_one_line_with_the_file(calm, monkeypatch):
    monkeypatch.setattr("sys.path", list(sys.path))
    for name, (before, after, words) in REFUSED.items():
        file = calm(name, before, after)
        answer = IsolatedTrackers(None).perform("describe", name=str(file), options={})
        assert words in answer["unusable"]
        assert file.name in answer["unusable"]
        assert "\n" not in answer["unusable"]


def test_import_changes_nothing_in_this_process(calm, capfd):
    threads, folder = set(threading.enumerate()), Path.cwd()
    files = [str(calm(name, before)) for name, before in TAKEN.items()]
    specs = resolve_specs(["static", *files])
    assert list(specs) == ["static", *files]
    assert capfd.readouterr() == ("", "")
    for thread in set(threading.enumerate()) - threads:
        thread.join(10)  # that of an ended process also ends
    assert (set(threading.enumerate()), Path.cwd()) == (threads, folder)


@pytest.mark.parametrize("act", ENDS)
def test_file_that_ends_its_process_is_named(calm, act):
    files = [str(calm("good")), str(calm("bad", act))]
    with pytest.raises(TrackerError, match=rf"bad\.py: the import failed: {ENDS[act]}"):
        resolve_specs(files)


def test_tracker_of_a_file_is_described(calm):
    file = calm("file", after="    presets = {'a': {}}\n    name = 'mine'")
    texts = [f"{file}:Calm:preset=a", f"{file}:as=other:init=full", f"{file}:Calm"]
    mine, other, calm_class = resolve_specs(texts).values()
    assert [mine.label, other.label, calm_class.label] == [
        "mine:preset=a",
        "other:init=full",
        "mine",
    ]
    assert (mine.preset, other.preset, other.init) == ("a", "recommended", "full")
    assert mine.parameters == {}
    assert mine.file == file
    assert mine.is_isolated
    assert mine.version == tracker_version("mine", file, "Calm")
    assert describe_tracker(str(file)) == trackers.describe(str(file))


def test_command_survives_file_that_exits(trackmark, workspace, one_line):
    (workspace / "exits.py").write_text("import sys; sys.exit(0)")
    options = ("--sequences", "data/Small", "--json")
    done = trackmark("run", "--trackers", "exits.py", *options, status=2)
    assert done.stdout == ""
    message = "trackmark: exits.py: the file cannot be imported: SystemExit: 0 (line 1). The file "
    assert one_line(done).startswith(message)
