"""Specifications, tables and versions of trackers in processes of their own."""

import os
import re
import sys

import pytest

from tests.bench.external.conftest import HOME, TRAX, living
from trackmark import datasets
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.execution.cluster import with_absolute_paths
from trackmark.bench.execution.task import PlannedRun, Task
from trackmark.bench.experiments.experiment import SequenceSpec
from trackmark.bench.experiments.tracker_spec import describe_tracker, parse_tracker
from trackmark.bench.external.trax import TraxPlugin
from trackmark.trackers import Randomness, TrackerError, static

pytestmark = pytest.mark.usefixtures("folder")


def trax(options="as=mine", arguments="4"):
    return f'trax:command="{sys.executable} plain.py {arguments}":{options}'


def test_run_of_a_command_equals_that_of_static_in_process():
    run, expected = (evaluate_run(text, "Noise") for text in (trax(), "static"))
    assert not run.failure
    assert run.boxes.tobytes() == expected.boxes.tobytes()
    assert run.identity.tracker == "mine"
    assert run.metadata["clock"] == TraxPlugin.clock
    assert not evaluate_run(trax(), "Noise", protocol="tre:starts=3").failure
    assert not living("plain.py")


def test_version_depends_on_command_and_files(folder, monkeypatch):
    def version(text):
        return parse_tracker(text).version

    first, released = version(trax()), version(trax("as=mine:version=1.2"))
    assert (first["name"], first["command"]) == ("plain", f"{sys.executable} plain.py 4")
    assert version(trax("as=mine:frame_limit=5")) == first
    assert version(trax(arguments="1")) != first
    assert released["source"] == "1.2"
    (folder / "plain.py").write_text(TRAX.read_text().replace("a banner", "a longer banner"))
    assert version(trax()) != first
    assert version(trax("as=mine:version=1.2")) == released
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    program, sources = folder / "my-tracker", set()
    for number in (1, 4):  # a program in PATH
        program.write_text(f"#!/bin/sh\nexec {sys.executable} {TRAX} {number}\n")
        program.chmod(0o755)
        sources.add(version("trax:command=my-tracker:as=mine")["source"])
    assert len(sources - {""}) == 2


def test_example_of_a_table_for_a_class_works(environment, folder, monkeypatch):
    """Relative paths refer to the folder of the file; the table's name is the tracker's."""
    page = (HOME / "docs" / "external.md").read_text()
    code, table = (re.search(rf"```{name}\n(.*?)```", page, re.S)[1] for name in ("python", "toml"))
    (folder / "matcher.py").write_text(code)
    (folder / "trackers.toml").write_text(table)
    (folder / "envs").mkdir()
    (folder / "envs" / "torch").symlink_to(environment)
    sequence = datasets.load(str(folder / "Noise"))
    monkeypatch.chdir("envs")
    spec = parse_tracker("../trackers.toml:mine:size=3")
    assert (spec.label, spec.parameters) == ("mine:size=3", {"size": 3.0})
    assert spec.version["source"] == "1.2"
    assert not evaluate_run("../trackers.toml:mine", sequence).failure


TABLES = """
broken = 1
[good]
trax = "{python} plain.py 1 properties"
environment = {{ HANGS = "{hangs}" }}
parameters = {{ size = 2.5 }}
stochastic = true
[ignoring]
trax = "{python} plain.py 4 confidence"
confidence = false
[typo]
files = "a.py"
[none]
python = "p"
[both]
file = "a.py"
trax = "b"
[late]
file = "a.py"
frame_limit = "x"
[other]
file = "a.py"
stochastic = true
"""
VOT = """
[module]
label = A module
protocol = traxpython
command = plain_4
paths = {folder}/nothing:modules
python = {python}
timeout = 20
env_mode = $HANGS
arg_size = 2
meta_author = A. N. Other
[statements]
protocol = traxpython
command = import plain, sys; sys.argv = ["", "1"]; plain.main()
paths = .
[whole]
protocol = trax
command = {python} plain.py 4
linkpaths = lib
version = 2.0
[matlab]
protocol = traxmatlab
command = tracker
"""


@pytest.fixture
def tables(folder, hangs):
    """Write files of trackers."""
    for name, text in {"trackers.toml": TABLES, "trackers.ini": VOT, "bad.toml": "[x"}.items():
        (folder / name).write_text(text.format(python=sys.executable, folder=folder, hangs=hangs))
    (folder / "bad.ini").write_text("command = x")
    (folder / "needy.py").write_text("import no_such_library")
    (folder / "half.py").write_text("class Half:\n    def init(self, image, box): pass")


def test_table_for_a_command_defines_a_tracker(tables, folder, monkeypatch):
    """The tracker runs in the folder of the file."""
    monkeypatch.chdir("Noise")
    spec = parse_tracker("../trackers.toml:good")
    assert (spec.label, spec.parameters) == ("good", {"size": 2.5})
    assert spec.randomness is Randomness.GENERATOR
    assert parse_tracker("../trackers.toml:good:size=3").label == "good:size=3"
    for name in ("good", "ignoring"):
        run = evaluate_run(f"../trackers.toml:{name}", str(folder / "Noise"))
        assert not run.failure
    assert "plain.py 1" in describe_tracker("../trackers.toml:good")["summary"]


def test_file_of_vot_toolkit_defines_trackers(tables, folder):
    (folder / "modules").mkdir()
    module = folder / "modules" / "plain_4.py"
    code = "import os, sys\nassert os.environ['MODE'] == os.environ['HANGS']\n"
    module.write_text(f"{code}sys.argv[1:] = ['4']\n{TRAX.read_text()}")
    for name in ("module", "statements", "whole", "module:as=other"):
        run = evaluate_run(f"trackers.ini:{name}", "Noise")
        assert not run.failure
        assert run.identity.tracker == name.rpartition("=")[2]
    spec = parse_tracker("trackers.ini:module")
    assert spec.parameters == {"size": "2"}
    module.write_text(f"{code}sys.argv[1:] = ['1']\n{TRAX.read_text()}")
    assert parse_tracker("trackers.ini:module").version != spec.version
    assert parse_tracker("trackers.ini:whole").version["source"] == "2.0"


INVALID = {
    "trax:command=./a": "trax: the name is missing. Add as=NAME.",
    "trax:as=mine": "trax: the command is missing. Give trax:command=COMMAND:as=NAME.",
    "trax:command=./a:b:as=mine": "A command with ':' needs a table of a TOML file.",
    "trax:command=./a 'b:as=mine": "No closing quotation.",
    'trax:command=./a "b":as=mine': "./a b: the command cannot be started: ",
    "trax:command=./a:as=mine:start_limit=0": "start_limit=0: Input should be greater than 0",
    trax("as=mine:size=2"): "unknown parameter of mine 'size'.",
    trax("as=mine:confidnce=2"): "'confidnce'. Did you mean 'confidence'?",
    "trax:command=true:as=mine": "ended with status 0 (no TraX hello).",
    trax("as=static"): "the name 'static' belongs to another tracker.",
    trax(
        arguments="4 'no start'"
    ): "ended with status 1 (no TraX hello). Its last line: no licence\nThe end of its output:\n",
    trax(
        arguments="4 slow"
    ): "did not answer in 300 s (no TraX hello). Its last line: loading weights\n",
    trax(arguments="4 depth"): "reads the image channels ['depth']. Expected: color",
    trax(arguments="4 url"): "reads images by ['url']. Expected: path, memory or buffer",
    trax(arguments="5"): "uses version '5' of TraX. Expected: 1 to 4",
    "plain_tracker.py:python=no/such": "cannot be started: ",
    f"needy.py:python={sys.executable}": "No module named 'no_such_library'",
    f"plain_tracker.py:python={sys.executable}:stop=1": "unknown parameter of plain_tracker",
    "plain_tracker.py:pyhton=p": "'pyhton'. Did you mean 'python'?",
    f"half.py:Half:python={sys.executable}": "half.py:Half: it lacks update.",
    f"half.py:Halb:python={sys.executable}": "half.py:Halb: the file has no class 'Halb'.",
    f"{static.__file__}:python={sys.executable}": "Static: it derives from TrackerPlugin. Omit",
    "trackers.toml": "To use a tracker of this file, give trackers.toml:NAME.",
    "trackers.toml:other": "unknown parameter of trackers.toml:other 'stochastic'.",
    "trackers.ini:matlab": "[matlab]: protocol = traxmatlab, command = tracker. Expected: ",
    "trackers.ini:modul": "unknown tracker of trackers.ini 'modul'. Did you mean 'module'?",
    "nothing.ini:mine": "nothing.ini: No such file or directory.",
    "bad.toml:mine": "bad.toml: Expected",
    "trackers.toml:broken": "trackers.toml: broken is a value. Expected: a table [broken].",
    "trackers.toml:typo": "parameter of trackers.toml:typo 'files'. Did you mean 'file'?",
    "trackers.toml:none": "trackers.toml:none: file is ''. Expected: a Python file (.py), or",
    "trackers.toml:both": "trackers.toml:both: give either the key 'file' or the key 'trax'",
    "trackers.toml:late": "trackers.toml:late: parameter frame_limit=x: Input should be a valid",
}


@pytest.mark.parametrize("text", INVALID)
def test_invalid_specification_is_explained(tables, text):
    with pytest.raises(TrackerError) as raised:
        parse_tracker(text)
    assert INVALID[text] in str(raised.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (trax(), f"{trax()}:folder={{folder}}"),
        ("trax:command=./a b.toml c.py:as=x", "trax:command=./a b.toml c.py:as=x:folder={folder}"),
        ("a.toml:mine:step=3", "{folder}/a.toml:mine:step=3"),
        ("a.py:python=./env", "{folder}/a.py:python={folder}/env"),
    ],
)
def test_specification_for_another_folder_has_absolute_paths(folder, text, expected):
    task = Task(SequenceSpec("Noise"), (PlannedRun(text, None),), 6)
    (run,) = with_absolute_paths(task).runs
    assert run.tracker == expected.format(folder=folder)
