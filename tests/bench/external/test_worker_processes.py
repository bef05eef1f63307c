"""Failures of external trackers in worker processes of the harness."""

import sys
from contextlib import closing
from pathlib import Path

import pytest

from tests.bench.external.conftest import TRAX, living
from trackmark import datasets
from trackmark.bench.engine import pool as pool_module
from trackmark.bench.engine.pool import Pool
from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.experiments.tracker_files import resolve_trackers
from trackmark.bench.experiments.tracker_spec import run_identity
from trackmark.bench.external.process import delete_frame_files

pytestmark = pytest.mark.usefixtures("folder")


def perform(texts, options=""):
    """Return the outcomes of runs in worker processes by specification; add options to these."""
    specs, units = resolve_trackers(texts), []
    assert not living("plain")
    for text, spec in specs.items():
        version = run_identity(spec, datasets.load("Noise"), 0).version
        entries, seconds = (Entry(text + options, 0, version),), spec.call_seconds
        source = SequenceSource("Noise")
        units.append(Unit(source, entries, "accuracy", 8, owner=text, call_seconds=seconds))
    with closing(Pool(Limits())) as pool:
        outcomes = {unit.owner: outcome for unit, outcome in pool.perform(units)}
    assert not living("plain")
    return outcomes


def test_worker_process_contains_failures(environment, monkeypatch):
    """Failures cost their own runs; neither a process nor a file for frames remains."""
    ended = []

    def delete(pid):
        ended.append(pid)
        delete_frame_files(pid)

    monkeypatch.setattr(pool_module, "delete_frame_files", delete)
    command = f"trax:command={sys.executable} plain.py 4"
    texts = {
        f"{command}:as=calm": "",
        f"{command} exit:as=exit": "plain.py 4 exit: the process ended with status 7",
        f"plain_tracker.py:python={environment}:mode=raise": "raised ValueError: broken",
        f"plain_tracker.py:python={environment}": "",
    }
    hang = f"{command} hang:as=hang"
    outcomes = perform(texts) | perform([hang], ":frame_timeout=3")
    texts[hang] = "plain.py 4 hang: the process did not answer in 3 s"
    for text, failure in texts.items():
        reason = outcomes[text].runs[0].failure
        assert bool(reason) == bool(failure)
        assert failure in reason
    assert ended
    assert not [file for pid in ended for file in Path("/dev/shm").glob(f"trackmark-*-{pid}-*")]


def test_frame_files_of_a_killed_process_are_deleted():
    file = Path("/dev/shm/trackmark-frames-99999999-x.bmp")
    file.touch()
    delete_frame_files(99999999)
    assert not file.exists()


def test_failed_start_in_a_worker_is_an_error_of_the_sequence(folder):
    """The process starts once for the plan and once for the run, which gets no licence here."""
    (folder / "used").mkdir()
    code = "import os, sys\nif os.listdir('used'): sys.exit('no licence')\n"
    file = folder / "licensed.py"
    file.write_text(f"{code}open('used/1', 'w').close()\n{TRAX.read_text()}")
    (outcome,) = perform([f"trax:command={sys.executable} licensed.py 4:as=mine"]).values()
    assert "Noise: " in str(outcome)
    assert "ended with status 1. The end of its output:\nno licence" in str(outcome)
