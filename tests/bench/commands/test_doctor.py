"""`doctor` in installations that are damaged or unusual."""

import json
import os
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import cv2
import pytest

from trackmark.datasets import source_digest

ROOT = Path(__file__).parents[3]
COMPILE = (
    "from trackmark.trackers.maps.differences import _sum_channels as kernel; import numpy as np; "
)
COMPILE += "kernel(np.zeros((2, 2, 3), np.uint8), np.zeros((2, 2), np.uint16))"


@pytest.fixture
def copied_doctor(tmp_path):
    """Copy the package to `tmp_path`, and run `doctor --json` of the copy."""
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "trackmark", tmp_path / "trackmark", ignore=ignore)

    def call(**environment):
        code = "import sys; from trackmark.bench.cli import main; "
        code += "sys.argv = ['trackmark', 'doctor', '--json']; main()"
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONPATH": str(tmp_path)} | environment,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 1, done.stderr
        assert done.stderr == ""
        return json.loads(done.stdout)

    return call


def test_doctor_reports_that_no_kernel_can_be_stored(copied_doctor, tmp_path):
    package = tmp_path / "trackmark" / "trackers"
    for folder in package.iterdir():
        if folder.is_dir():
            (folder / "__pycache__").touch()  # a file: Numba cannot make the folder
    nowhere = str(package / "camshift.py")
    about = copied_doctor(XDG_CACHE_HOME=nowhere, HOME=nowhere, TRACKMARK_CACHE=str(tmp_path))
    (problem,) = about["problems"]
    assert problem.endswith(". Set NUMBA_CACHE_DIR to a folder that can be written.")
    assert about["caches"]["compiled kernels"].startswith("not available (")


@pytest.mark.slow
def test_doctor_counts_kernels_in_the_cache_folder_of_numba(
    trackmark_process, tmp_path, monkeypatch
):
    folder = tmp_path / "kernels"
    code = f"{COMPILE}; from trackmark.bench.cli import main; main(['doctor', '--json'])"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder)}
    output = subprocess.check_output([sys.executable, "-c", code], env=environment, text=True)
    kernels = json.loads(output)["caches"]["compiled kernels"]
    assert kernels == f"1 in {folder}"


def installed_as(monkeypatch, *names):
    """Let the distributions `names` provide cv2, in place of the installed one."""
    owners = [SimpleNamespace(name=name, version="4.1", metadata={"Name": name}) for name in names]
    others = dict(source_digest._distributions())
    monkeypatch.setattr(source_digest, "_distributions", lambda: {**others, "cv2": owners})
    monkeypatch.setattr(source_digest, "_versions", source_digest._versions.__wrapped__)


@pytest.mark.parametrize("name", ["opencv-contrib-python", ""])
def test_doctor_finds_opencv_under_any_name(trackmark, monkeypatch, name):
    installed_as(monkeypatch, *([name] if name else []))
    about = json.loads(trackmark("doctor", "--json").stdout)
    expected = {name: "4.1"} if name else {"cv2": cv2.__version__}
    assert expected.items() <= about["versions"].items()
    assert not any("cv2" in problem for problem in about["problems"])


def test_doctor_reports_two_distributions_of_opencv(trackmark, monkeypatch):
    installed_as(monkeypatch, "opencv-python", "opencv-python-headless")
    (problem,) = json.loads(trackmark("doctor", "--json", status=1).stdout)["problems"]
    assert problem.startswith("2 distributions provide cv2: install exactly one. Run `pip uninst")


def test_doctor_accepts_opencv_contrib_over_opencv(trackmark, monkeypatch):
    installed_as(monkeypatch, "opencv-contrib-python-headless", "opencv-python-headless")
    # A tracker that is imported with this OpenCV would stay usable in later tests.
    monkeypatch.setattr("trackmark.bench.commands.doctor._trackers", dict)
    monkeypatch.delattr(cv2, "legacy", raising=False)
    monkeypatch.setattr(cv2, "TrackerKCF_create", None, raising=False)
    (problem,) = json.loads(trackmark("doctor", "--json", status=1).stdout)["problems"]
    command = "pip install --force-reinstall --no-deps opencv-contrib-python-headless"
    assert problem.endswith(f"replaced the files of {command.split()[-1]}. Run `{command}`.")
    monkeypatch.setattr(cv2, "TrackerKCF_create", object)
    assert json.loads(trackmark("doctor", "--json").stdout)["problems"] == []


def test_doctor_names_missing_model_files(trackmark):
    states = json.loads(trackmark("doctor", "--json").stdout)["trackers"]
    assert states["opencv-nano"] == "needs backbone=PATH, neckhead=PATH"
    assert states["static"] == "ready"


def test_doctor_works_without_metadata_of_trackmark(trackmark, monkeypatch):
    def version(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr("trackmark.bench.package_version.version", version)
    about = json.loads(trackmark("doctor", "--json").stdout)
    assert about["environment"]["trackmark"] == "unknown"


def test_doctor_reports_a_library_that_reads_no_video(trackmark, monkeypatch):
    def open_with_other_keywords(file, **keywords):
        raise TypeError("unexpected keyword argument")

    monkeypatch.setattr("av.open", open_with_other_keywords)
    problems = json.loads(trackmark("doctor", "--json", status=1).stdout)["problems"]
    assert problems == [
        "samples/face: reading fails (TypeError: unexpected keyword argument). "
        "Install the versions of constraints.txt."
    ]
