"""Trackers from outside the package: their files are imported in a child process."""

import json
import threading
from pathlib import Path

import pytest

from trackmark import trackers
from trackmark.bench.experiments import tracker_files
from trackmark.bench.experiments.tracker_files import describe_tracker, resolve_trackers
from trackmark.bench.experiments.tracker_spec import parse_tracker
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
    "forks": "import os; os.fork()",
}
ENDS = {
    "ends": ("import os; os._exit(0)", "its process ends with status 0"),
    "is killed": ("import os; os.kill(os.getpid(), 9)", "its process ends with status -9"),
}


@pytest.fixture
def calm(tmp_path):
    """Write a file with a tracker: code before the class, and code within or after the class."""

    def write(name, before="", after=""):
        file = tmp_path / f"{name.replace(' ', '-')}.py"
        file.write_text(f"{before}\n{CALM}\n{after}\n")
        return file

    return write


def test_error_of_an_import_is_one_line_with_the_file(calm):
    files = {str(calm(name, *rest)): words for name, (*rest, words) in REFUSED.items()}
    _, lines = tracker_files._child(json.dumps(["parse", list(files)]))
    errors = {text: error for text, error, _ in map(json.loads, lines)}
    assert errors.keys() == files.keys()
    for file, words in files.items():
        assert words in errors[file]
        assert Path(file).name in errors[file]
        assert "\n" not in errors[file]


def test_import_changes_nothing_in_this_process(calm, capfd):
    threads, folder = threading.active_count(), Path.cwd()
    files = [str(calm(name, before)) for name, before in TAKEN.items()]
    specs = resolve_trackers(["static", *files])
    assert list(specs) == ["static", *files]
    assert capfd.readouterr() == ("", "")
    assert (threading.active_count(), Path.cwd()) == (threads, folder)


@pytest.mark.parametrize("case", ENDS)
def test_file_that_ends_the_child_is_named(calm, case):
    act, words = ENDS[case]
    good, bad = str(calm("good")), str(calm("bad", act))
    with pytest.raises(TrackerError, match=rf"bad\.py: the import failed: {words}\."):
        resolve_trackers([good, bad])


def test_import_that_never_ends_is_stopped(calm, monkeypatch):
    monkeypatch.setattr(tracker_files, "_SECONDS", 0.2)
    with pytest.raises(
        TrackerError, match=r"file\.py: the import failed: nothing happens for 0.2 s"
    ):
        describe_tracker(str(calm("file", "while True: pass")))


def test_tracker_from_the_child_equals_an_imported_one(calm):
    file = calm("file", after="    presets = {'a': {}}\n    name = 'mine'")
    texts = [f"{file}:Calm:preset=a", f"{file}:as=other:init=full", "camshift:window=adaptive"]
    for text, spec in resolve_trackers(texts).items():
        imported = parse_tracker(text)
        assert spec.label == imported.label
        assert spec.version == imported.version
        for name in ("name", "preset", "parameters", "randomness", "file", "init"):
            assert getattr(spec, name) == getattr(imported, name)
        assert type(spec.make(0)).__name__ == type(imported.make(0)).__name__
    assert describe_tracker(str(file)) == trackers.describe(str(file))


def test_command_survives_file_that_exits(trackmark, workspace, one_line):
    (workspace / "exits.py").write_text("import sys; sys.exit(0)")
    options = ("--sequences", "data/Small", "--json")
    done = trackmark("run", "--trackers", "exits.py", *options, status=2)
    assert done.stdout == ""
    message = "trackmark: exits.py: the file cannot be imported: SystemExit: 0 (line 1). The file "
    assert one_line(done).startswith(message)
