"""Settings and fixtures of all tests."""

import gc
import os
import signal

import pytest
from hypothesis import settings

from trackmark.bench.numba_compilation import prepare_numba

# No deadline: the first call of a kernel compiles it, and the machine can be busy.
settings.register_profile("everyday", deadline=None, max_examples=25)
settings.register_profile("nightly", deadline=None, max_examples=200)

os.environ["COLUMNS"] = "80"  # independent of the terminal
signal.signal(signal.SIGINT, signal.default_int_handler)  # shells ignore it in background jobs

prepare_numba()  # tests run in parallel

EVIDENCE = pytest.StashKey()


def pytest_configure(config):
    """Generate more examples at night; collect tests without garbage collection."""
    gc.disable()
    settings.load_profile("everyday" if "not slow" in config.option.markexpr else "nightly")


def pytest_collection_finish():
    """Exclude modules and tests from garbage collections, which would visit them often."""
    gc.freeze()
    gc.enable()


@pytest.fixture
def evidence(request):
    """Return a function that adds a line to the end of the test report."""
    return request.config.stash.setdefault(EVIDENCE, []).append


def pytest_terminal_summary(terminalreporter, config):
    """Print the lines of `evidence`."""
    for line in config.stash.get(EVIDENCE, []):
        terminalreporter.write_line(line)
