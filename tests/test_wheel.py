"""The wheel and the source archive: their files, and an installation next to other packages."""

import re
import subprocess
import sys
import tarfile
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

import trackmark
from trackmark import datasets
from trackmark.bench.package_version import package_version
from trackmark.datasets import samples

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


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    """Return the paths of the wheel and of the source archive."""
    folder = str(tmp_path_factory.mktemp("archives"))
    builders = WheelBuilder(str(ROOT)), SdistBuilder(str(ROOT))
    return [Path(next(builder.build(directory=folder))) for builder in builders]


def test_module_runs_as_the_command():
    call = [sys.executable, "-m", "trackmark", "--version"]
    printed = subprocess.run(call, capture_output=True, text=True, check=True).stdout
    assert printed == f"trackmark {trackmark.__version__}\n"


def test_archives_pass_the_checks_of_a_package_index(archives):
    programs = Path(sys.executable).parent
    subprocess.run([programs / "twine", "check", "--strict", *archives], check=True)
    subprocess.run([programs / "check-wheel-contents", archives[0]], check=True, cwd=ROOT)


def test_wheel_is_small(archives):
    assert archives[0].stat().st_size - samples.CLIP.stat().st_size < 3e6


def test_clip_of_the_samples_has_its_licence(archives):
    with ZipFile(archives[0]) as wheel:
        licence = wheel.read("trackmark/datasets/samples/LICENCE.txt").decode()
        assert f"trackmark/datasets/samples/{samples.CLIP.name}" in wheel.namelist()
    assert "Redistribution and use in source and binary forms" in licence


def test_source_archive_builds_the_same_wheel(archives, tmp_path):
    wheel, source = archives
    with tarfile.open(source) as archive:
        archive.extractall(tmp_path, filter="data")
    (folder,) = tmp_path.iterdir()
    rebuilt = Path(next(WheelBuilder(str(folder)).build(directory=str(tmp_path))))
    with ZipFile(wheel) as expected, ZipFile(rebuilt) as result:
        assert [(file.filename, file.CRC) for file in result.infolist()] == [
            (file.filename, file.CRC) for file in expected.infolist()
        ]


def test_changelog_and_citation_have_version_and_date():
    citation = (ROOT / "CITATION.cff").read_text()
    changes = (ROOT / "CHANGELOG.md").read_text()
    version, date = re.search(r"^## (\S+) \((\d{4}-\d\d-\d\d)\)$", changes, re.M).groups()
    assert version == package_version()
    assert f"\nversion: {version}\ndate-released: {date}\n" in citation


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
def test_wheel_works_next_to_foreign_packages(archives, tmp_path):
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    wheels = [
        archives[0],
        *(write_foreign_wheel(tmp_path, name) for name in ("datasets", "trackers")),
    ]
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
