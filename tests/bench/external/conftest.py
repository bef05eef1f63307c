"""Interpreters without trackmark, a clock for trackers that hang, and the end of processes."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from trackmark.bench.external import process
from trackmark.bench.external.plugin import close_idle_processes

FILE = Path(__file__).with_name("plain_tracker.py")
_PROBE = """
import sys
import numpy
try:
    import trackmark
except ImportError:
    print(sys.version_info[:3])
"""


@pytest.fixture(scope="session")
def environment(tmp_path_factory):
    """Return a virtual environment with NumPy and without trackmark."""
    folder = tmp_path_factory.mktemp("environments") / "plain"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    (packages,) = folder.glob("lib/python*/site-packages")
    site = Path(np.__file__).parents[1]
    for name in ("numpy", "numpy.libs"):
        if (site / name).exists():
            (packages / name).symlink_to(site / name)
    assert _version(folder / "bin" / "python") == str(sys.version_info[:3])
    return folder


@pytest.fixture(scope="session")
def other_python():
    """Return an interpreter of another version with NumPy and without trackmark."""
    for python in filter(None, [os.environ.get("OTHER_PYTHON"), *_interpreters()]):
        if _version(python) not in ("", str(sys.version_info[:3])):
            return python
    pytest.skip("no Python of another version has NumPy; name one: OTHER_PYTHON=/path/to/python")


@pytest.fixture(scope="session")
def other_environment(tmp_path_factory):
    """Return a virtual environment of another version of Python, with NumPy from the index."""
    current = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    others = [python for python in _interpreters() if python.name != current]
    for number, python in enumerate(sorted(others, key=lambda python: len(python.name))):
        folder = tmp_path_factory.mktemp("other") / str(number)
        pip = folder / "bin" / "python", "-m", "pip", "install", "--quiet", "numpy"
        for command in ([python, "-m", "venv", folder], pip):
            done = subprocess.run(command, capture_output=True, check=False)
        if done.returncode == 0:
            return folder
    pytest.skip("no other Python is installed for which pip can install NumPy")


def _interpreters():
    pattern = "bin/python3.*[0-9]"
    return [*Path.home().glob(f".pyenv/versions/*/{pattern}"), *Path("/usr").glob(pattern)]


def _version(python):
    done = subprocess.run([python, "-I", "-c", _PROBE], capture_output=True, text=True, check=False)
    return done.stdout.strip()


@pytest.fixture(autouse=True)
def _no_processes_afterwards():
    yield
    close_idle_processes()


@pytest.fixture
def clock_of_hangs(tmp_path, monkeypatch):
    """Let time pass only while a tracker hangs, however busy the machine is."""
    marker = tmp_path / "hangs"
    monkeypatch.setenv("HANGS", str(marker))
    seconds = 0.0

    def monotonic():
        nonlocal seconds
        seconds += 100 * marker.exists()
        return seconds

    monkeypatch.setattr(process, "monotonic", monotonic)


def living(program):
    """Return the ids of running processes of a program; their environment names this test."""
    ids = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            marked = os.environ["HANGS"].encode() in (folder / "environ").read_bytes()
            if marked and program.encode() in (folder / "cmdline").read_bytes():
                ids.append(int(folder.name))
    return ids
