"""What holds for all tests."""

import os

import pytest
from hypothesis import settings

from trackmark.bench.numba_compilation import attend

# A kernel's first call compiles it, and the machine may be busy: time decides nothing here.
settings.register_profile("trackmark", deadline=None)
settings.load_profile("trackmark")

os.environ["COLUMNS"] = "100"  # however wide the terminal is that they run in

attend()  # tests run side by side

EVIDENCE = pytest.StashKey()


@pytest.fixture
def evidence(request):
    """Note a line that stands at the end of the tests' report."""
    return request.config.stash.setdefault(EVIDENCE, []).append


def pytest_terminal_summary(terminalreporter, config):
    """Say what was counted."""
    for line in config.stash.get(EVIDENCE, []):
        terminalreporter.write_line(line)
