"""Runs of trackers that speak TraX; failures of external trackers in worker processes."""

import os
import shutil
import sys
from contextlib import closing
from pathlib import Path

import pytest

from tests.bench.external.conftest import FILE, living
from trackmark import bench, datasets
from trackmark.bench.engine import pool as pool_module
from trackmark.bench.engine.dask import with_absolute_paths
from trackmark.bench.engine.pool import Pool
from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.experiments.tracker_files import describe_tracker, resolve_trackers
from trackmark.bench.experiments.tracker_spec import parse_tracker, run_identity, split_text
from trackmark.bench.external.plugin import TRANSFER_CLOCK
from trackmark.bench.external.process import delete_frame_files
from trackmark.trackers import Randomness, TrackerError

PLAIN = Path(__file__).with_name("trax_trackers") / "plain.py"


pytestmark = pytest.mark.usefixtures("clock_of_hangs")


@pytest.fixture
def folder(tmp_path, otb, monkeypatch):
    """Return the working directory, which has a sequence of 6 frames and a tracker."""
    otb(tmp_path / "Noise", 6)
    shutil.copy(PLAIN, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def specification(options="as=mine", arguments="4"):
    return f'trax:command="{sys.executable} plain.py {arguments}":{options}'


def test_run_equals_that_of_static_in_process(folder):
    sequence = datasets.load("Noise")
    run, expected = (bench.evaluate_run(text, sequence) for text in (specification(), "static"))
    assert not run.failure
    assert run.boxes.tobytes() == expected.boxes.tobytes()
    assert run.identity.tracker == "mine"
    assert run.circumstances["clock"] == TRANSFER_CLOCK
    segments = bench.evaluate_run(specification(), sequence, protocol="tre:starts=3")
    assert not segments.failure
    assert not living("plain.py")


def test_identity_depends_on_command_and_files(folder):
    def version(options="as=mine", arguments="4"):
        return parse_tracker(specification(options, arguments)).version

    first = version()
    assert first["name"] == "plain"
    assert first["command"] == f"{sys.executable} plain.py 4"
    assert version("as=mine:frame_timeout=5") == first
    assert version(arguments="1") != first
    released = version("as=mine:version=1.2")
    assert released["source"] == "1.2"
    file = folder / "plain.py"
    file.write_text(file.read_text().replace('"a banner"', '"a longer banner"'))
    assert version() != first
    assert version("as=mine:version=1.2") == released


def test_program_in_path_is_part_of_the_identity(folder, monkeypatch):
    program = folder / "bin" / "my-tracker"
    program.parent.mkdir()
    monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)
    sources = []
    for version in (1, 4):
        program.write_text(f"#!/bin/sh\nexec {sys.executable} {PLAIN} {version}\n")
        program.chmod(0o755)
        sources.append(parse_tracker("trax:command=my-tracker:as=mine").version["source"])
    assert all(sources)
    assert sources[0] != sources[1]


TABLES = """
[good]
trax = "{python} plain.py 1"
environment = {{ HANGS = "{hangs}" }}
parameters = {{ size = 2.5 }}
stochastic = true
[bad]
trax = "{python} plain.py 4 confidence"
[ignoring]
trax = "{python} plain.py 4 confidence"
confidence = false
"""


def test_table_of_a_file_defines_a_tracker(folder, tmp_path_factory, monkeypatch):
    """The tracker runs in the folder of the file; the table's name is the tracker's."""
    file = folder / "trackers.toml"
    file.write_text(TABLES.format(python=sys.executable, hangs=os.environ["HANGS"]))
    sequence = datasets.load(str(folder / "Noise"))
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    spec = parse_tracker(f"{file}:good")
    assert (spec.label, spec.parameters) == ("good", {"size": 2.5})
    assert spec.randomness is Randomness.GENERATOR
    assert parse_tracker(f"{file}:good:size=3").label == "good:size=3"
    assert not bench.evaluate_run(f"{file}:good", sequence).failure
    assert "Add confidence=false" in bench.evaluate_run(f"{file}:bad", sequence).failure
    for text in (f"{file}:ignoring", f"{file}:bad:confidence=false"):
        assert not bench.evaluate_run(text, sequence).failure
    assert "plain.py 1" in describe_tracker(f"{file}:good")["summary"]


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
[socket]
protocol = trax
command = tracker
socket = true
"""


def test_file_of_vot_toolkit_defines_trackers(folder):
    (folder / "trackers.ini").write_text(VOT.format(python=sys.executable, folder=folder))
    (folder / "modules").mkdir()
    module = folder / "modules" / "plain_4.py"
    code = "import os, sys\nassert os.environ['MODE'] == os.environ['HANGS']\n"
    module.write_text(f"{code}sys.argv[1:] = ['4']\n{PLAIN.read_text()}")
    for name in ("module", "statements", "whole", "module:as=other"):
        run = bench.evaluate_run(f"trackers.ini:{name}", "Noise")
        assert not run.failure
        assert run.identity.tracker == name.rpartition("=")[2]
    spec = parse_tracker("trackers.ini:module")
    assert spec.parameters == {"size": "2"}
    module.write_text(f"{code}sys.argv[1:] = ['1']\n{PLAIN.read_text()}")
    assert parse_tracker("trackers.ini:module").version != spec.version
    assert parse_tracker("trackers.ini:whole").version["source"] == "2.0"


INVALID = {
    "trax:command=./a": "trax: the name is missing. Add as=NAME.",
    "trax:as=mine": "trax: the command is missing. Give trax:command=COMMAND:as=NAME.",
    "trax:command=./a:b:as=mine": "A command with ':' needs a table of a TOML file.",
    "trax:command=./a 'b:as=mine": "No closing quotation.",
    "trax:command=./a:as=mine": "./a: the command cannot be started: ",
    "trax:command=./a:as=mine:start_timeout=0": "start_timeout=0: Input should be greater than 0",
    specification("as=mine:size=2"): "unknown parameter of mine 'size'.",
    specification("as=static"): "the name 'static' belongs to another tracker.",
    specification(arguments="4 'no start'"): "ended with status 1. The end of its output:\nno lic",
    "trackers.ini:matlab": "[matlab]: protocol = traxmatlab, command = tracker. Expected: ",
    "trackers.ini:socket": "[socket]: socket = true is not supported. Remove the key.",
    "trackers.ini:modul": "unknown tracker of trackers.ini 'modul'. Did you mean 'module'?",
    "nothing.ini:mine": "nothing.ini: No such file or directory.",
    "broken.ini:mine": "broken.ini: File contains no section headers.",
}


@pytest.mark.parametrize("text", INVALID)
def test_invalid_specification_is_explained(folder, text):
    (folder / "trackers.ini").write_text(VOT.format(python=sys.executable, folder=folder))
    (folder / "broken.ini").write_text("command = x")
    with pytest.raises(TrackerError) as raised:
        parse_tracker(text)
    assert INVALID[text] in str(raised.value)


def test_worker_process_contains_failures(folder, environment, monkeypatch):
    """Failures cost their own runs; neither a process nor a file for frames remains."""
    ended = []

    def delete(pid):
        ended.append(pid)
        delete_frame_files(pid)

    monkeypatch.setattr(pool_module, "delete_frame_files", delete)
    texts = {
        specification("as=calm"): "",
        specification("as=exit", "4 exit"): "plain.py 4 exit: the process ended with status 7",
        specification("as=hang", "4 hang"): "plain.py 4 hang: the process did not answer in 3 s",
        f"{FILE}:python={environment}:mode=raise": "the process raised ValueError: broken",
        f"{FILE}:python={environment}": "",
    }
    specs = resolve_trackers(texts)
    assert not living("plain")
    units = []
    for text, spec in specs.items():
        limit = ":frame_timeout=3" if "hang" in text else ""
        version = run_identity(spec, datasets.load("Noise"), 0).version
        entries, source = (Entry(text + limit, 0, version),), SequenceSource("Noise")
        seconds = spec.call_seconds
        units.append(Unit(source, entries, "accuracy", 6, owner=text, call_seconds=seconds))
    with closing(Pool(Limits())) as pool:
        failures = {unit.owner: outcome.runs[0].failure for unit, outcome in pool.perform(units)}
    assert not living("plain")
    for text, failure in failures.items():
        assert bool(failure) == bool(texts[text])
        assert texts[text] in failure
    assert ended
    assert not [file for pid in ended for file in Path("/dev/shm").glob(f"trackmark-*-{pid}-*")]


def test_frame_files_of_a_killed_process_are_deleted(folder):
    file = Path("/dev/shm/trackmark-frames-99999999-x.bmp")
    file.touch()
    delete_frame_files(99999999)
    assert not file.exists()


def test_failed_start_in_a_worker_is_an_error_of_the_sequence(folder):
    """The process starts once for the plan and once for the run, which gets no licence here."""
    (folder / "used").mkdir()
    file = folder / "licensed.py"
    code = "import os, sys\nif os.listdir('used'): sys.exit('no licence')\n"
    file.write_text(f"{code}open('used/1', 'w').close()\n{PLAIN.read_text()}")
    text = f"trax:command={sys.executable} licensed.py 4:as=mine"
    version = run_identity(resolve_trackers([text])[text], datasets.load("Noise"), 0).version
    unit = Unit(SequenceSource("Noise"), (Entry(text, 0, version),), "accuracy", 6, owner=text)
    with closing(Pool(Limits())) as pool:
        ((_, outcome),) = pool.perform([unit])
    assert "Noise: " in str(outcome)
    assert "ended with status 1. The end of its output:\nno licence" in str(outcome)


def test_command_can_end_with_a_file(folder):
    name, options = split_text("trax:command=./server cfg.toml my.py:as=mine")
    assert (name, options) == ("trax", {"command": "./server cfg.toml my.py", "as": "mine"})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (specification(), f"{specification()}:folder={{folder}}"),
        ("a.toml:mine:step=3", "{folder}/a.toml:mine:step=3"),
        ("a.py:python=./env", "{folder}/a.py:python={folder}/env"),
    ],
)
def test_specification_for_another_folder_has_absolute_paths(folder, text, expected):
    unit = Unit(SequenceSource("Noise"), (Entry(text, 0, ""),), "accuracy", 6)
    (entry,) = with_absolute_paths(unit).entries
    assert entry.tracker == expected.format(folder=folder)
