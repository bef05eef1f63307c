"""Trackers by name: found by their files, by plugins' files and entry points."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numba.core.caching import CacheImpl

from trackmark import trackers
from trackmark.trackers.base import catalogue
from trackmark.trackers.base.parameters import TrackerError

PLUGIN = '''"""A tracker of somebody else's."""

import numpy as np
from pydantic import Field

from trackmark.trackers import Estimate, Parameters, TrackerPlugin


class Settings(Parameters):
    step: float = Field(1.0, description="how far it moves [pixels]")
    twice: bool = Field(False, description="whether it moves twice")


class Drift(TrackerPlugin):
    """Moves right."""

    presets = {"fast": {"step": 5.0}}
    Parameters = Settings

    def init(self, image, box, mask=None):
        self.box = box.copy()

    def update(self, image):
        self.box = self.box + [self.parameters.step, 0, 0, 0]
        return Estimate(self.box)


class NotATracker:
    pass
'''


@pytest.fixture(autouse=True)
def _fresh_catalogue():
    catalogue._load.cache_clear()
    yield
    catalogue._load.cache_clear()


@pytest.fixture
def plugin(tmp_path):
    file = tmp_path / "drift.py"
    file.write_text(PLUGIN)
    return file


def installed(tmp_path, monkeypatch, entries, source=PLUGIN, distribution="drifters"):
    """A tiny installed distribution that offers trackers."""
    site = tmp_path / distribution
    information = site / f"{distribution}-1.0.dist-info"
    information.mkdir(parents=True)
    (site / f"{distribution}.py").write_text(source)
    (information / "METADATA").write_text(f"Name: {distribution}\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[trackmark.trackers]\n" + entries)
    monkeypatch.syspath_prepend(site)
    # syspath_prepend leaves the module behind once it is imported.
    monkeypatch.delitem(sys.modules, distribution, raising=False)


def first_step(tracker):
    image = np.zeros((9, 9, 3), np.uint8)
    tracker.init(image, np.array([1.0, 2.0, 3.0, 4.0]))
    return tracker.update(image).box.tolist()


def test_names_are_the_files_with_hyphens_for_underscores():
    names = trackers.names()
    assert {"static", "camshift", "opencv-median-flow"} <= set(names)
    assert not {"base", "__init__", "--init--", "opencv_mil", "opencv"} & set(names)


@pytest.mark.parametrize(
    ("wrong", "closest"),
    [
        ("camshfit", "camshift"),
        ("opencv_mil", "opencv-mil"),
        ("Static", "static"),
        ("kcf", "opencv-kcf"),
        ("CSRT", "opencv-csrt"),
    ],
)
def test_an_unknown_name_lists_the_known_and_the_closest(wrong, closest):
    with pytest.raises(TrackerError) as caught:
        trackers.create(wrong)
    assert f"unknown tracker {wrong!r}. Did you mean {closest!r}?" in str(caught.value)
    assert all(name in str(caught.value) for name in trackers.names())


@pytest.mark.parametrize("name", ["", "base", "__init__", "--init--", "base/catalogue", "../x"])
def test_what_is_no_tracker_file_is_unknown(name):
    with pytest.raises(TrackerError, match="unknown tracker"):
        trackers.create(name)


def test_an_unknown_preset_lists_the_known_and_the_closest():
    with pytest.raises(TrackerError) as caught:
        trackers.resolve("camshift", preset="as_written")
    assert str(caught.value) == (
        "unknown preset of camshift 'as_written'. Did you mean 'as-written'? "
        "Known: as-written, recommended."
    )


def test_options_are_what_differs_from_the_preset():
    resolved = trackers.resolve("camshift", window="adaptive", hue_bins="16", max_iterations=10)
    assert resolved.options == {"hue_bins": 16, "window": "adaptive"}
    assert trackers.resolve("camshift", preset="as-written").options == {"preset": "as-written"}


def test_a_preset_comes_first_and_values_override_it(plugin):
    name = f"{plugin}:Drift"
    assert trackers.resolve(name).parameters.step == 1
    assert trackers.resolve(name, preset="fast").parameters.step == 5
    both = trackers.resolve(name, preset="fast", step="7", twice="true")
    assert both.parameters.step == 7
    assert both.options == {"preset": "fast", "step": 7.0, "twice": True}
    assert list(both.options) == ["preset", "step", "twice"]


def test_a_tracker_from_a_file_anywhere(plugin):
    specification = trackers.resolve(f"{plugin}:Drift")
    assert specification.name == "drift.py:Drift"
    assert specification.file == plugin.resolve()
    assert first_step(trackers.create(f"{plugin}:Drift", step=2)) == [3, 2, 3, 4]


def test_plugin_file_errors_state_the_problem(plugin):
    with pytest.raises(TrackerError, match=r"missing\.py: this tracker file does not exist"):
        trackers.create(f"{plugin.parent}/missing.py:Drift")
    with pytest.raises(TrackerError, match=r"class in .*drift\.py 'Drfit'. Did you mean 'Drift'"):
        trackers.create(f"{plugin}:Drfit")
    with pytest.raises(TrackerError, match="not a class derived from"):
        trackers.create(f"{plugin}:NotATracker")
    incomplete = plugin.with_name("lacking.py")
    incomplete.write_text("import a_library_that_nobody_has\n")
    with pytest.raises(TrackerError, match="cannot be used: No module named 'a_library_that"):
        trackers.create(f"{incomplete}:Drift")


def test_an_edit_of_equal_size_in_the_same_second_is_loaded(plugin):
    assert first_step(trackers.create(f"{plugin}:Drift")) == [2, 2, 3, 4]
    stamp = plugin.stat()
    plugin.write_text(PLUGIN.replace("Field(1.0", "Field(8.0"))
    os.utime(plugin, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    catalogue._load.cache_clear()
    assert first_step(trackers.create(f"{plugin}:Drift")) == [9, 2, 3, 4]


def test_missing_folder_for_compiled_kernels_is_reported(monkeypatch):
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    monkeypatch.delitem(sys.modules, "trackmark.trackers.camshift", raising=False)
    monkeypatch.delitem(sys.modules, "trackmark.trackers.maps.back_projection", raising=False)
    with pytest.raises(
        TrackerError, match=r"'camshift' .* Set NUMBA_CACHE_DIR to a writable folder\."
    ):
        trackers.create("camshift")


def test_a_third_partys_tracker_is_found_by_its_entry_point(tmp_path, monkeypatch):
    installed(tmp_path, monkeypatch, "drift = drifters:Drift\n")
    assert trackers.names()[-1] == "drift"
    assert trackers.summary("drift") == "third party: drifters:Drift"
    assert catalogue.is_outside("drift")
    assert not catalogue.is_outside("static")
    assert "drifters" not in sys.modules
    specification = trackers.resolve("drift", preset="fast")
    assert specification.name == "drift"
    assert specification.file == tmp_path / "drifters" / "drifters.py"
    assert first_step(specification.create()) == [6, 2, 3, 4]


def test_entry_point_with_missing_dependency_is_rejected(tmp_path, monkeypatch):
    source = "import a_library_that_nobody_has\n"
    installed(tmp_path, monkeypatch, "drift = drifters:Drift\n", source)
    assert "drift" in trackers.names()
    with pytest.raises(TrackerError, match="'drift' cannot be used: No module named"):
        trackers.create("drift")


def test_a_name_offered_twice_is_an_error_that_names_both(tmp_path, monkeypatch):
    installed(tmp_path, monkeypatch, "drift = drifters:Drift\nstatic = drifters:Drift\n")
    installed(tmp_path, monkeypatch, "drift = rivals:Drift\n", distribution="rivals")
    with pytest.raises(
        TrackerError, match=r"'drift' is defined by several packages: .*rivals:Drift"
    ):
        trackers.create("drift")
    with pytest.raises(TrackerError, match="several packages: trackmark, drifters:Drift"):
        trackers.create("static")


def test_describe_gives_parameters_with_default_type_and_meaning(plugin):
    actual = trackers.describe("camshift")
    assert actual["name"] == "camshift"
    assert "Bradski" in actual["paper"]
    assert actual["randomness"] == "none"
    assert set(actual["presets"]) == {"as-written", "recommended"}
    window, bins = actual["parameters"][:2]
    assert [*window.values()][:3] == ["window", "fixed | adaptive", "fixed"]
    assert [*bins.values()][:3] == ["hue_bins", "int", 32]
    assert bins["meaning"].endswith("[count]")
    types = {about["name"]: about["type"] for about in trackers.describe("wang2010")["parameters"]}
    assert (types["radius"], types["difference_window"]) == ("float | rule", "int")
    drift = trackers.describe(f"{plugin}:Drift")
    assert drift["presets"] == {"recommended": {}, "fast": {"step": 5.0}}
    assert trackers.summary("static") == "Constant init box: the lower reference of every table."


def test_listing_imports_no_tracker_and_no_heavy_library():
    program = (
        "import sys\nfrom trackmark import trackers\n"
        "assert [trackers.summary(name) for name in trackers.names()]\n"
        "heavy = {'cv2', 'numba', 'pandas', 'matplotlib', 'scipy', 'av'} & set(sys.modules)\n"
        "own = [name for name in sys.modules if name.startswith('trackmark.trackers.')\n"
        "       and not name.startswith('trackmark.trackers.base')]\n"
        "print(sorted(heavy), own)"
    )
    actual = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert actual.stdout.strip() == "[] []", actual.stderr
