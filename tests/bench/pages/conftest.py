"""Shared browser, results and page of the tests of pages."""

import pytest

from tests.bench.pages.reading import write_experiment_page
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec

DRIFTING = '''
"""Drifts randomly."""
from trackmark.trackers.base.interface import Estimate, Randomness, TrackerPlugin


class Drifting(TrackerPlugin):
    """Drifts."""

    randomness = Randomness.GENERATOR

    def init(self, image, box, mask=None):
        import numpy
        self.box, self.random = box, numpy.random.default_rng(self.seed)

    def update(self, image):
        self.box = self.box + [*self.random.normal(0.5, 1.5, 2), 0, 0]
        return Estimate(self.box)

    def finish(self):
        return {3: self.box}
'''


@pytest.fixture(scope="session")
def drifting(tmp_path_factory):
    """Provide the specification of a stochastic tracker that revises boxes."""
    file = tmp_path_factory.mktemp("drifting") / "drifting.py"
    file.write_text(DRIFTING)
    return f"{file}:Drifting"


@pytest.fixture(scope="session")
def results(tmp_path_factory, without_processes, drifting):
    """Provide runs of three trackers on six sequences with three repetitions, once per process."""
    sources = [f"plain/target:length=60:scene={n}" for n in range(5)]
    sources += ["plain/target:length=60:scene=9:noise=30"]
    trackers = ("static", "camshift", drifting)
    experiment = Experiment("trial", trackers, tuple(map(SequenceSpec, sources)), repetitions=3)
    with without_processes():
        return run_experiment(experiment, tmp_path_factory.mktemp("paged"), jobs=1)


@pytest.fixture(scope="session")
def page(results, tmp_path_factory):
    """Provide the page of `results`."""
    return write_experiment_page(results, tmp_path_factory.mktemp("page"))


@pytest.fixture
def opened_page(chromium, page):
    """Open the page in a browser, and check at the end that its console is empty."""
    chromium.open("data:text/html,")  # messages of the previous page are ignored
    chromium.console.clear()
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    yield chromium
    assert chromium.console == []
