"""The four import names are ours alone; where they are not, that is said."""

import subprocess
import sys
import venv
from importlib import metadata
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

from bench.packages import NAMES, NameClashError, check_ownership, check_place

ROOT = Path(__file__).parents[2]


def test_the_names_are_provided_by_trackmark_alone():
    owners = metadata.packages_distributions()
    assert {name: set(owners.get(name, ())) - {"trackmark"} for name in NAMES} == {
        name: set() for name in NAMES
    }


def test_all_is_well_here():
    check_place()
    check_ownership()


def test_a_foreign_package_that_comes_first_is_named(tmp_path):
    (tmp_path / "datasets").mkdir()
    (tmp_path / "datasets" / "__init__.py").write_text("")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import bench"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert "NameClashError: the package 'datasets' would come from" in last
    assert str(tmp_path) in last


def test_another_distribution_in_the_same_folder_is_named(tmp_path, monkeypatch):
    info = tmp_path / "datasets-5.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: datasets\nVersion: 5.2\n")
    (info / "RECORD").write_text("datasets/__init__.py,,\n")
    (tmp_path / "datasets").mkdir()
    (tmp_path / "datasets" / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(NameClashError, match="'datasets' also installs a package 'datasets'"):
        check_ownership()


def test_the_wheel_holds_all_that_pages_are_made_of():
    held = {file.path for file in WheelBuilder(str(ROOT)).recurse_included_files()}
    parts = [path for path in (ROOT / "reports" / "page").iterdir() if path.is_file()]
    assert {".html", ".css", ".js", ".py"} == {path.suffix for path in parts}
    assert {str(path) for path in parts} <= held


@pytest.mark.slow
def test_the_wheel_holds_the_four_packages_with_their_data_and_nothing_else(tmp_path):
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--quiet",
            "--no-deps",
            "--wheel-dir",
            tmp_path,
            ROOT,
        ],
        check=True,
    )
    (wheel,) = tmp_path.glob("*.whl")
    config = ["--toplevel", ",".join(NAMES)]
    subprocess.run(
        ["check-wheel-contents", *config, wheel], check=True, env={"PATH": path_with_bin()}
    )
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--no-deps", wheel], check=True)
    code = (
        "from pathlib import Path; from importlib.metadata import files;"
        "names = {str(f) for f in files('trackmark')};"
        "assert {'datasets/samples/face.csv', 'bench/experiments/demo.toml'} <= names, names"
    )
    subprocess.run([python, "-c", code], check=True)


def path_with_bin():
    return f"{Path(sys.executable).parent}:/usr/bin:/bin"
