"""The wheel and the source archive: their files, and an installation next to other packages."""

import os
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
from trackmark.reports.video import save_video

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
FLAGS = re.DOTALL | re.MULTILINE
CODE = re.compile(r"(^```(\w*)\n(.*?)^```$)|`([^`\n]+)`", FLAGS)  # blocks, and code in sentences
ROLES = ("AUTHOR", "COMMITTER")
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
    assert {".html", ".css", ".js", ".woff2", ".txt"} == {path.suffix for path in parts}
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


@pytest.fixture
def environment(archives, tmp_path):
    """Install the wheel and foreign packages into a new environment; return its folder.

    Libraries come from the environment of the tests, after the packages of the new one.
    """
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    foreign = [write_foreign_wheel(tmp_path, name) for name in ("datasets", "trackers")]
    install = [python, "-m", "pip", "install", "--quiet", "--no-deps"]
    subprocess.run([*install, archives[0], *foreign], check=True)
    (packages,) = (tmp_path / "venv").glob("lib/*/site-packages")
    (packages / "libraries.pth").write_text(str(Path(pytest.__file__).parents[1]))
    return tmp_path / "venv"


@pytest.mark.slow
def test_wheel_works_next_to_foreign_packages(environment, tmp_path):
    python = environment / "bin" / "python"
    done = subprocess.run(
        [python, "-c", USE_BOTH], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    file, fingerprint = done.stdout.split()
    (packages,) = environment.glob("lib/*/site-packages")
    assert file == str(packages / "trackmark" / "trackers" / "static.py")
    assert fingerprint == datasets.load("samples/face").fingerprint


def readme_commands(text):
    """Return the command lines of a page in their order, also those in its sentences."""
    commands = []
    for _, language, block, inline in CODE.findall(text):
        lines = block.splitlines()
        if inline:
            commands += [inline] * inline.startswith("trackmark run ")
        elif any(line.startswith("$ ") for line in lines):
            commands += [line[2:] for line in lines if line.startswith("$ ")]
        elif not language and re.match(r"(trackmark|git|pip) ", block):
            commands += lines
    return commands


def test_readme_commands_have_an_order():
    commands = [" ".join(line.split()[:2]) for line in readme_commands(README)]
    assert commands[:2] == ["pip install", "trackmark demo"]
    order = ["trackmark reproduce", "trackmark run", "trackmark compare", "trackmark baseline"]
    order += ["git add", "trackmark check", "trackmark annotate", "trackmark show"]
    assert [commands.index(command) for command in order] == sorted(map(commands.index, order))


@pytest.mark.weekly
def test_readme_commands_run_from_the_wheel(environment, tmp_path):
    folder = tmp_path / "empty"
    folder.mkdir()
    for name, content in re.findall(r"here \*([\w.]+)\*[^`]*?```\w+\n(.*?)^```$", README, FLAGS):
        (folder / name).write_text(content)
    video = datasets.load("plain/target:length=40:width=640:height=480")
    save_video(folder / "cup.mp4", ((frame, video[frame]) for frame in range(len(video))), {})
    # Other load can need a larger budget of time, and can make a tracker look slower (status 1).
    commands = [
        re.sub(r"--timing --revision \S+", r"\g<0> --budget 6h || test $? = 1", line)
        for line in readme_commands(README)
        if not line.startswith("pip install")
    ]
    identity = {f"GIT_{role}_{field}": "a@b" for role in ROLES for field in ("NAME", "EMAIL")}
    subprocess.run(["git", "init", "--quiet"], cwd=folder, check=True)
    done = subprocess.run(
        ["bash", "-ex", "-c", "\n".join(commands)],
        cwd=folder,
        env=os.environ | identity | {"PATH": f"{environment / 'bin'}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    for name in ("out/demo/report.html", "results/windows/report.html", "tracked.mp4"):
        assert (folder / name).stat().st_size
