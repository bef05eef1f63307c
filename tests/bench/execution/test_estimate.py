"""Tests of the estimated remaining time: its measurements and its text."""

import shutil

import pytest

from trackmark.bench.engine.work_unit import Limits
from trackmark.bench.execution.estimate import Basis, Estimate, estimate, read_measured_times, words
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.execution.plan import make_plan
from trackmark.bench.execution.scheduling import missing_units
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.store.results import Results

SLEEPER = '''
"""Takes its time."""
import time
from pydantic import Field
from trackmark.trackers.base.interface import Estimate, TrackerPlugin
from trackmark.trackers.base.parameters import Parameters


class SleeperParameters(Parameters):
    milliseconds: float = Field(1.0, description="for a frame [ms]")


class Sleeper(TrackerPlugin):
    """Sleeps."""

    Parameters = SleeperParameters

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        time.sleep(self.parameters.milliseconds / 1e3)
        return Estimate(self.box)
'''


@pytest.fixture
def data_folder(workspace):
    (workspace / "sleeper.py").write_text(SLEEPER)
    shutil.copytree(workspace / "data" / "Small", workspace / "data" / "Other")
    return workspace


def make_experiment(data_folder, milliseconds, sequences=("Small",), name="trial"):
    trackers = tuple(
        f"{data_folder / 'sleeper.py'}:Sleeper:milliseconds={ms}" for ms in milliseconds
    )
    sources = tuple(SequenceSource(str(data_folder / "data" / sequence)) for sequence in sequences)
    return Experiment(name, trackers, sources)


def estimated(data_folder, chosen, **limits):
    plan = make_plan(chosen, Results(data_folder / "results" / chosen.name))
    units = missing_units(plan, workers=1)
    return estimate(units, read_measured_times(data_folder / "results"), Limits(**limits))


def test_estimate_uses_the_nearest_measurement(data_folder, in_this_process):
    run_experiment(make_experiment(data_folder, [100]), data_folder / "results", jobs=1)
    chosen = make_experiment(data_folder, [100, 50], ("Small", "Other"), name="next")
    estimate = estimated(data_folder, chosen)
    assert estimate.bases == {Basis.NAME: 2, Basis.TRACKER: 1, Basis.SEQUENCE: 1}
    # Each of four runs calls the tracker four times, with at most 0.1 s per call.
    assert estimate.high > 1.6
    assert 0 < estimate.low < estimate.high


def test_unmeasured_tracker_is_probed_and_nothing_is_stored(data_folder, in_this_process):
    estimate = estimated(data_folder, make_experiment(data_folder, [20]))
    assert estimate.bases == {Basis.PROBE: 1}
    assert not (data_folder / "results").exists()
    assert estimated(data_folder, make_experiment(data_folder, [20, 200])).high > 4 * 0.2


def test_tracker_that_hangs_in_probe_is_reported(data_folder):
    estimate = estimated(data_folder, make_experiment(data_folder, [1, 60_000]), frame_seconds=1.0)
    assert estimate.bases == {Basis.PROBE: 1, Basis.NOTHING: 1}


def test_plan_without_missing_runs_takes_no_time(data_folder, in_this_process):
    run_experiment(make_experiment(data_folder, [1]), data_folder / "results", jobs=1)
    assert estimated(data_folder, make_experiment(data_folder, [1])) == Estimate(0.0, 0.0, {})


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (0.0, 0.4, "1 to 1 seconds"),
        (11.4, 36.7, "11 to 37 seconds"),
        (70.0, 130.0, "1.2 to 2.2 minutes"),
        (4000.0, 9100.0, "1.1 to 2.5 hours"),
        (1e6, 2e6, "12 to 23 days"),
    ],
)
def test_estimate_text_has_two_digits(low, high, text):
    assert words(Estimate(low, high, {})) == text
