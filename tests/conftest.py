"""What holds for all tests."""

import os

import pytest
from hypothesis import settings

from trackmark.bench.numba_compilation import attend

# A kernel's first call compiles it, and the machine may be busy: time decides nothing here.
settings.register_profile("everyday", deadline=None, max_examples=50)
settings.register_profile("nightly", deadline=None, max_examples=200)

os.environ["COLUMNS"] = "100"  # however wide the terminal is that they run in

attend()  # tests run side by side

EVIDENCE = pytest.StashKey()


def pytest_configure(config):
    """Generate more examples at night."""
    settings.load_profile("everyday" if "not slow" in config.option.markexpr else "nightly")


@pytest.fixture
def evidence(request):
    """Note a line that stands at the end of the tests' report."""
    return request.config.stash.setdefault(EVIDENCE, []).append


def pytest_terminal_summary(terminalreporter, config):
    """Say what was counted."""
    for line in config.stash.get(EVIDENCE, []):
        terminalreporter.write_line(line)
