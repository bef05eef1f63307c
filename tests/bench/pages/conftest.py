"""The browser that tests of pages share, and a page that it opens."""

import pytest

from tests import browser
from tests.bench.pages.reading import written
from trackmark import bench
from trackmark.bench.experiments.experiment import Experiment, SequenceSource

DRIFTING = '''
"""Goes astray, each time another way."""
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
def chromium(tmp_path_factory):
    opened = browser.Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def drifting(tmp_path_factory):
    """A tracker that draws and revises, as it is asked for."""
    file = tmp_path_factory.mktemp("drifting") / "drifting.py"
    file.write_text(DRIFTING)
    return f"{file}:Drifting"


@pytest.fixture(scope="session")
def results(tmp_path_factory, without_processes, drifting):
    """Three trackers on six sequences, three times, run once for all tests of a process."""
    sources = [f"plain/target:length=60:scene={n}" for n in range(5)]
    sources += ["plain/target:length=60:scene=9:noise=30"]
    trackers = ("static", "camshift", drifting)
    asked = Experiment("trial", trackers, tuple(map(SequenceSource, sources)), repetitions=3)
    with without_processes():
        return bench.run(asked, tmp_path_factory.mktemp("paged"), jobs=1)


@pytest.fixture(scope="session")
def page(results, tmp_path_factory):
    """Their page."""
    return written(results, tmp_path_factory.mktemp("page"))


@pytest.fixture
def shown(chromium, page):
    """The page in a browser that has nothing to complain of."""
    chromium.open("data:text/html,")  # what the page before has still to say is its own matter
    chromium.console.clear()
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    yield chromium
    assert chromium.console == []
