"""Interpreters without trackmark, a clock for trackers that hang, and the end of processes."""

import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import trackmark
from trackmark.bench.external import close_idle_processes, process

HOME = Path(trackmark.__file__).parents[1]
DRIFT = Path(__file__).with_name("plain_tracker.py")
TRAX = Path(__file__).with_name("trax_trackers") / "plain.py"


@pytest.fixture
def folder(tmp_path, otb, monkeypatch):
    """Return the working directory, which has a sequence of 8 frames and two trackers."""
    otb(tmp_path / "Noise", 8)
    for file in (DRIFT, TRAX):
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


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
    probe = [folder / "bin" / "python", "-I", "-c", "import numpy, trackmark"]
    done = subprocess.run(probe, capture_output=True, text=True, check=False)
    assert "No module named 'trackmark'" in done.stderr
    return folder


@pytest.fixture(scope="session")
def other_environment(tmp_path_factory):
    """Return a virtual environment of another version of Python, with NumPy from the index."""
    current = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    pattern = "bin/python3.*[0-9]"
    pythons = [*Path.home().glob(f".pyenv/versions/*/{pattern}"), *Path("/usr").glob(pattern)]
    others = [python for python in pythons if python.name != current]
    for number, python in enumerate(sorted(others, key=lambda python: len(python.name))):
        folder = tmp_path_factory.mktemp("other") / str(number)
        pip = folder / "bin" / "python", "-m", "pip", "install", "--quiet", "numpy"
        for command in ([python, "-m", "venv", folder], pip):
            done = subprocess.run(command, capture_output=True, check=False)
        if done.returncode == 0:
            return folder
    pytest.skip("no other Python is installed for which pip can install NumPy")


@pytest.fixture(autouse=True)
def _no_processes_afterwards():
    yield
    close_idle_processes()


@pytest.fixture(autouse=True)
def hangs(tmp_path, monkeypatch):
    """Let time pass only while a tracker hangs, however busy the machine is; return its file."""
    marker = tmp_path / "hangs"
    monkeypatch.setenv("HANGS", str(marker))
    seconds = 0.0

    def monotonic():
        nonlocal seconds
        seconds += 100 * marker.exists()
        return seconds

    monkeypatch.setattr(process, "monotonic", monotonic)
    return marker


def living(program):
    """Return the ids of running processes of a program; their environment names this test."""
    ids = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            marked = os.environ["HANGS"].encode() in (folder / "environ").read_bytes()
            if marked and program.encode() in (folder / "cmdline").read_bytes():
                ids.append(int(folder.name))
    return ids
