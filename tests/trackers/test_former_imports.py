"""Tracker files that import `trackers` and `datasets` instead of `trackmark.trackers`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

FILE = """
import datasets
from trackers.base.interface import Estimate, TrackerPlugin


class Former(TrackerPlugin):
    def init(self, image, box, mask=None):
        import trackers.base.sharing as late

        self.box, self.name = box, late.__name__

    def update(self, image):
        if self.name != "trackmark.trackers.base.sharing" or {attribute!r} not in dir(datasets):
            raise ValueError(f"{{self.name}}, {{datasets}}")
        return Estimate(self.box)
"""


def run_former(tmp_path, attribute, *command):
    """Run a command on the tracker of a file, and return the line that warns of its imports."""
    (tmp_path / "former.py").write_text(FILE.format(attribute=attribute))
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (warning,) = (text for text in done.stderr.splitlines() if "deprecated" in text)
    return warning.removeprefix(str(tmp_path / "former.py"))


PROGRAM = (
    "import numpy as np; from trackmark import trackers;"
    "image, tracker = np.zeros((9, 9, 3), np.uint8), trackers.create('former.py');"
    "tracker.init(image, np.array([1.0, 2, 3, 4])); tracker.update(image)"
)


def test_former_import_names_work_with_a_warning(tmp_path):
    assert run_former(tmp_path, "names", sys.executable, "-c", PROGRAM) == (
        ":2: the import name `datasets` is deprecated. The next release removes it. Import "
        "`trackmark.datasets` instead."
    )


def test_package_of_another_project_keeps_its_former_name(tmp_path):
    (tmp_path / "datasets").mkdir()
    (tmp_path / "datasets" / "__init__.py").write_text("load_dataset = print\n")
    warning = run_former(tmp_path, "load_dataset", sys.executable, "-c", PROGRAM)
    assert warning.startswith(":3: the import name `trackers.base.interface` is deprecated.")


@pytest.mark.slow
def test_command_reports_former_import_names(tmp_path):
    script = Path(sys.executable).with_name("trackmark")
    arguments = ["run", "--trackers", "former.py", "--sequences", "samples/bow-tie"]
    warning = run_former(tmp_path, "names", script, *arguments)
    assert warning.startswith(":2: the import name `datasets` is deprecated.")
