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


@pytest.mark.parametrize(
    ("attribute", "module", "line"),
    [("load_dataset", "trackers.base.interface", 3), ("names", "datasets", 2)],
)
def test_former_import_names_work_with_a_warning(tmp_path, attribute, module, line):
    file = tmp_path / "former.py"
    file.write_text(FILE.format(attribute=attribute))
    if attribute == "load_dataset":  # another project's package keeps its name
        (tmp_path / "datasets").mkdir()
        (tmp_path / "datasets" / "__init__.py").write_text("load_dataset = print\n")
    script = Path(sys.executable).with_name("trackmark")
    arguments = ["run", "--trackers", "former.py", "--sequences", "samples/bow-tie"]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [script, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (warning,) = (text for text in done.stderr.splitlines() if "deprecated" in text)
    assert warning.startswith(f"{file}:{line}: the import name `{module}` is deprecated.")
    assert warning.endswith(f"Import `trackmark.{module}` instead.")
