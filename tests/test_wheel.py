"""The wheel: its files, and its installation next to packages with similar names."""

import subprocess
import sys
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest
from hatchling.builders.wheel import WheelBuilder

from trackmark import datasets

ROOT = Path(__file__).parents[1]
USE_BOTH = """
import datasets, trackers
from importlib.metadata import files
from trackmark import datasets as ours, trackers as our_trackers
assert datasets.FOREIGN and trackers.FOREIGN
names = {str(file) for file in files("trackmark")}
assert {f"trackmark/{file}" for file in ("datasets/samples/face.csv", "py.typed")} <= names, names
print(our_trackers.resolve("static").file, ours.load("samples/face").fingerprint)
"""


def test_wheel_has_all_page_files():
    included = {file.path for file in WheelBuilder(str(ROOT)).recurse_included_files()}
    parts = [path for path in (ROOT / "bench" / "pages" / "templates").iterdir() if path.is_file()]
    assert {".html", ".css", ".js"} == {path.suffix for path in parts}
    assert {str(path) for path in parts} <= included


def test_wheel_has_no_developer_tools():
    included = {file.distribution_path for file in WheelBuilder(str(ROOT)).recurse_included_files()}
    assert not [path for path in included if not path.startswith("trackmark/")]


def write_foreign_wheel(folder, name):
    """Write a wheel of another project that has a top-level package of this name."""
    info = f"{name}-5.2.dist-info"
    file = folder / f"{name}-5.2-py3-none-any.whl"
    with ZipFile(file, "w") as wheel:
        wheel.writestr(f"{name}/__init__.py", "FOREIGN = True\n")
        wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 5.2\n")
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\n")
        wheel.writestr(f"{info}/RECORD", f"{name}/__init__.py,,\n{info}/RECORD,,\n")
    return file


@pytest.mark.slow
def test_wheel_works_next_to_foreign_packages(tmp_path):
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", tmp_path]
    subprocess.run([*build, ROOT], check=True)
    (wheel,) = tmp_path.glob("*.whl")
    checker = Path(sys.executable).with_name("check-wheel-contents")
    subprocess.run([checker, "--toplevel", "trackmark", wheel], check=True)
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    wheels = [wheel, *(write_foreign_wheel(tmp_path, name) for name in ("datasets", "trackers"))]
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--no-deps", *wheels], check=True)
    (packages,) = (tmp_path / "venv").glob("lib/*/site-packages")
    # Our libraries come from this environment, after the packages of the new one.
    (packages / "libraries.pth").write_text(str(Path(pytest.__file__).parents[1]))
    done = subprocess.run(
        [python, "-c", USE_BOTH], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    file, fingerprint = done.stdout.split()
    assert file == str(packages / "trackmark" / "trackers" / "static.py")
    assert fingerprint == datasets.load("samples/face").fingerprint
