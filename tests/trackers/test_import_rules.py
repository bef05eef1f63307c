"""A tracker stands on the shared parts; these know no tracker."""

from pathlib import Path

import grimp
import pytest

from trackmark import trackers


@pytest.fixture(scope="module")
def imports():
    return grimp.build_graph("trackmark", cache_dir=None)


TRACKERS = {
    f"trackmark.trackers.{file.stem}" for file in Path(trackers.__file__).parent.glob("[!_]*.py")
}


def test_shared_parts_never_import_a_tracker(imports):
    assert "trackmark.trackers.static" in TRACKERS
    guilty = {
        f"{module} imports {actual}"
        for module in imports.find_descendants("trackmark.trackers") - TRACKERS
        for actual in imports.find_modules_directly_imported_by(module) & TRACKERS
    }
    assert not guilty
