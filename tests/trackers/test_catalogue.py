"""Catalogue of trackers: names, plugin files, entry points and imports."""

import os
import subprocess
import sys
from pathlib import Path

import grimp
import numpy as np
import pytest
from click.testing import CliRunner
from numba.core.caching import CacheImpl

from trackmark import trackers
from trackmark.bench.commands import describe
from trackmark.trackers.base import catalogue
from trackmark.trackers.base.parameters import TrackerError

PLUGIN = '''"""A third-party tracker."""

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
    catalogue._import.cache_clear()
    yield
    catalogue._import.cache_clear()


@pytest.fixture
def plugin(tmp_path):
    file = tmp_path / "drift.py"
    file.write_text(PLUGIN)
    return file


def installed(tmp_path, monkeypatch, entries, source=PLUGIN, distribution="drifters"):
    """Install a distribution with entry points of trackers."""
    site = tmp_path / distribution
    information = site / f"{distribution}-1.0.dist-info"
    information.mkdir(parents=True)
    (site / f"{distribution}.py").write_text(source)
    (information / "METADATA").write_text(f"Name: {distribution}\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[trackmark.trackers]\n" + entries)
    monkeypatch.syspath_prepend(site)
    # syspath_prepend does not remove an imported module.
    monkeypatch.delitem(sys.modules, distribution, raising=False)


def first_step(tracker):
    image = np.zeros((9, 9, 3), np.uint8)
    tracker.init(image, np.array([1.0, 2.0, 3.0, 4.0]))
    return tracker.update(image).box.tolist()


def test_tracker_names_are_file_names_with_hyphens():
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
def test_unknown_tracker_error_suggests_the_closest(wrong, closest):
    with pytest.raises(TrackerError) as caught:
        trackers.create(wrong)
    assert str(caught.value) == f"unknown tracker {wrong!r}. Did you mean {closest!r}?"


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("static:preset=recommended", {}, "Give options as arguments"),
        ("static", {"sequence": "samples/face"}, r"sequence is 'samples/face'. Expected: .*load_"),
        ("static", {"repetition": 2}, "repetition is 2 without a sequence"),
        (object, {}, "name is <class 'object'>. Expected: a text"),
    ],
)
def test_create_rejects_arguments_that_it_would_ignore(name, options, message):
    with pytest.raises(TrackerError, match=message):
        trackers.create(name, **options)


def test_unknown_preset_error_suggests_the_closest():
    with pytest.raises(TrackerError) as caught:
        trackers.resolve("camshift", preset="as_written")
    assert str(caught.value) == (
        "unknown preset of camshift 'as_written'. Did you mean 'as-written'?"
    )


def test_options_are_the_differences_from_the_preset():
    resolved = trackers.resolve("camshift", window="adaptive", hue_bins="16", max_iterations=11)
    assert resolved.options == {"hue_bins": 16, "window": "adaptive"}
    assert trackers.resolve("camshift", preset="as-written").options == {"preset": "as-written"}


def test_parameter_values_override_the_preset(plugin):
    name = f"{plugin}:Drift"
    assert trackers.resolve(name).parameters.step == 1
    assert trackers.resolve(name, preset="fast").parameters.step == 5
    both = trackers.resolve(name, preset="fast", step="7", twice="true")
    assert both.parameters.step == 7
    assert both.options == {"preset": "fast", "step": 7.0, "twice": True}
    assert list(both.options) == ["preset", "step", "twice"]


def test_tracker_in_a_file_outside_the_package_is_loaded(plugin):
    specification = trackers.resolve(f"{plugin}:Drift")
    assert specification.name == "drift.py:Drift"
    assert specification.file == plugin.resolve()
    assert first_step(trackers.create(f"{plugin}:Drift", step=2)) == [3, 2, 3, 4]


def test_plugin_file_errors_state_the_problem(plugin):
    with pytest.raises(TrackerError, match=r"missing\.py: this tracker file does not exist"):
        trackers.create(f"{plugin.parent}/missing.py:Drift")
    with pytest.raises(
        TrackerError, match=r"drift\.py: the file has no class 'Drfit'\. Did you mean 'Drift'"
    ):
        trackers.create(f"{plugin}:Drfit")
    with pytest.raises(TrackerError, match="it lacks init, update"):
        trackers.create(f"{plugin}:NotATracker")
    incomplete = plugin.with_name("lacking.py")
    incomplete.write_text("import a_library_that_nobody_has\n")
    with pytest.raises(TrackerError, match=r"'a_library_that.*\(line 1\)\. If another Python"):
        trackers.create(f"{incomplete}:Drift")


def test_edited_file_of_equal_size_and_time_is_reloaded(plugin):
    assert first_step(trackers.create(f"{plugin}:Drift")) == [2, 2, 3, 4]
    stamp = plugin.stat()
    plugin.write_text(PLUGIN.replace("Field(1.0", "Field(8.0"))
    os.utime(plugin, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert first_step(trackers.create(f"{plugin}:Drift")) == [9, 2, 3, 4]


def test_missing_folder_for_compiled_kernels_is_reported(monkeypatch):
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    monkeypatch.delitem(sys.modules, "trackmark.trackers.camshift", raising=False)
    monkeypatch.delitem(sys.modules, "trackmark.trackers.maps.back_projection", raising=False)
    with pytest.raises(
        TrackerError, match=r"'camshift' .* Set NUMBA_CACHE_DIR to a writable folder\."
    ):
        trackers.create("camshift")


def test_entry_point_of_another_package_is_a_tracker(tmp_path, monkeypatch):
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


def test_tracker_name_of_two_packages_is_rejected(tmp_path, monkeypatch):
    installed(tmp_path, monkeypatch, "drift = drifters:Drift\nstatic = drifters:Drift\n")
    installed(tmp_path, monkeypatch, "drift = rivals:Drift\n", distribution="rivals")
    with pytest.raises(
        TrackerError, match=r"'drift' is defined by several packages: .*rivals:Drift"
    ):
        trackers.create("drift")
    with pytest.raises(TrackerError, match="several packages: trackmark, drifters:Drift"):
        trackers.create("static")


def test_describe_lists_parameters_with_type_and_meaning(plugin):
    actual = trackers.describe("camshift")
    assert actual["name"] == "camshift"
    assert "Bradski" in actual["paper"]
    assert actual["randomness"] == "none"
    assert set(actual["presets"]) == {"as-written", "recommended"}
    by_name = {about["name"]: about for about in actual["parameters"]}
    window, bins = by_name["window"], by_name["hue_bins"]
    assert [*window.values()][:3] == ["window", "fixed | adaptive", "fixed"]
    assert [*bins.values()][:3] == ["hue_bins", "int", 32]
    assert bins["meaning"].endswith("[count]")
    types = {about["name"]: about["type"] for about in trackers.describe("wang2010")["parameters"]}
    assert (types["radius"], types["difference_window"]) == ("float | rule", "int")
    drift = trackers.describe(f"{plugin}:Drift")
    assert drift["presets"] == {"recommended": {}, "fast": {"step": 5.0}}
    assert trackers.summary("static") == "Constant init box: the lower reference of every table."


SOURCED = '''
class Sourced(Drift):
    """Moves right as in a paper."""

    class Parameters(Parameters):
        step: float = nonnegative(2.0, "step [pixels]", origin=printed("eq. 3"))
        count: int = integer(4, "repetitions [count]", origin=chosen("not printed; as in text"))
        twice: bool = choice(False, "whether it moves twice", origin=OPTION)

    presets = {"as-written": {}, "recommended": {"step": 1.0}}
    choices = {"first frame": (7, "the paper begins there")}
'''


def test_describe_prints_origins_and_choices(plugin):
    imports = "from trackmark.trackers.base.parameters import *\n"
    plugin.write_text(imports + PLUGIN.replace('"""A third', '"""Another') + SOURCED)
    about = trackers.describe(f"{plugin}:Sourced")
    step, count, twice = about["parameters"]
    assert (step["default"], step["as_written"], step["origin"]) == (1.0, 2.0, "printed: eq. 3")
    assert count["origin"] == "chosen: not printed; as in text"
    assert twice["origin"] == "option"
    assert about["presets"] == {"recommended": {}, "as-written": {"step": 2.0}}
    printed = CliRunner().invoke(describe.command, [f"{plugin}:Sourced"]).output
    assert "origins of the values in as-written\n  step=2.0     printed: eq. 3\n" in printed
    assert "choices that are no parameters\n  first frame: 7 (the paper begins there)\n" in printed


def test_listing_trackers_imports_no_heavy_library():
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


def test_shared_modules_import_no_tracker():
    files = Path(trackers.__file__).parent.glob("[!_]*.py")
    modules = {f"trackmark.trackers.{file.stem}" for file in files}
    assert "trackmark.trackers.static" in modules
    imports = grimp.build_graph("trackmark", cache_dir=None)
    wrong_imports = {
        f"{module} imports {tracker}"
        for module in imports.find_descendants("trackmark.trackers") - modules
        for tracker in imports.find_modules_directly_imported_by(module) & modules
    }
    assert not wrong_imports
