"""Digests of source code and its imports."""

import sys
from importlib import metadata

import pytest

from trackmark.datasets.source_digest import library_versions, source_digest


@pytest.fixture
def package(tmp_path):
    """Package in which `entry` imports `shared`, and `shared` imports `deep.leaf`, not `other`."""
    folder = tmp_path / "animals"
    (folder / "deep").mkdir(parents=True)
    (folder / "__init__.py").write_text("")
    (folder / "deep" / "__init__.py").write_text("")
    (folder / "entry.py").write_text("import numpy\nfrom animals.shared import thing\n")
    (folder / "shared.py").write_text("def thing():\n    import animals.deep.leaf\n")
    (folder / "deep" / "leaf.py").write_text("from animals import entry\nVALUE = 1\n")
    (folder / "other.py").write_text("VALUE = 1\n")
    return folder


@pytest.mark.parametrize("name", ["entry.py", "shared.py", "deep/leaf.py"])
def test_digest_depends_on_all_imported_modules(package, name):
    before, _ = source_digest(package / "entry.py", package)
    file = package / name
    file.write_text(file.read_text() + "changed = True\n")
    after, _ = source_digest(package / "entry.py", package)
    assert after != before


@pytest.mark.parametrize(
    "text",
    [
        "# A comment.\nfrom animals.shared import (\n    thing\n)\nimport numpy\n",
        "'A docstring.'\nimport numpy\nfrom animals.shared import thing\n",
        "import numpy\nfrom .shared import thing\n",
    ],
)
def test_digest_ignores_comments_and_order_of_imports(package, text):
    before, _ = source_digest(package / "entry.py", package)
    (package / "entry.py").write_text(text)
    assert source_digest(package / "entry.py", package)[0] == before


@pytest.mark.parametrize(
    "text",
    [
        "import numpy as n\nfrom animals.shared import thing\n",
        "import numpy\nfrom animals.shared import thing as other\n",
        "import numpy\nfrom animals.other import thing\n",
        "import numpy\nfrom animals.shared import thing\nX = 'a text'\n",
    ],
)
def test_digest_depends_on_imported_names_and_texts(package, text):
    before, _ = source_digest(package / "entry.py", package)
    (package / "entry.py").write_text(text)
    assert source_digest(package / "entry.py", package)[0] != before


def test_digest_ignores_names_and_folders_of_modules(package):
    before, _ = source_digest(package / "entry.py", package)
    (package / "shared.py").rename(package / "deep" / "common.py")
    (package / "entry.py").write_text("import numpy\nfrom animals.deep.common import thing\n")
    assert source_digest(package / "entry.py", package)[0] == before


def test_digest_is_equal_on_all_python_versions(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("import os\n\ndef f(x, *, y=2.5):\n    return f'{x:>{y}}' + os.sep\n")
    assert source_digest(file, tmp_path / "none")[0] == "e09cabc51fda4f77"


def test_digest_ignores_other_modules_and_the_package_folder(package, tmp_path):
    before, _ = source_digest(package / "entry.py", package)
    (package / "other.py").write_text("VALUE = 2\n")
    (tmp_path / "elsewhere").mkdir()
    moved = package.rename(tmp_path / "elsewhere" / "animals")
    assert source_digest(moved / "entry.py", moved)[0] == before


def test_source_is_not_imported(package):
    (package / "shared.py").write_text("raise RuntimeError\n")
    source_digest(package / "entry.py", package)
    assert not any(name.startswith("animals") for name in sys.modules)


def test_libraries_have_their_versions(package):
    _, libraries = source_digest(package / "entry.py", package)
    assert libraries == {"numpy": metadata.version("numpy")}


def test_distribution_can_differ_from_the_import_name():
    (name,) = library_versions({"cv2", "json", "no_such_library"})
    assert name.startswith("opencv")


def test_distributions_equal_those_of_importlib():
    distributions = metadata.packages_distributions()
    imports = {name for name in distributions if name.isidentifier()}
    assert library_versions(imports) == {
        name: metadata.version(name)
        for top in imports - sys.stdlib_module_names
        for name in distributions[top]
    }


def test_digest_of_a_file_outside_the_package(package, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("import animals.shared\n")
    before, _ = source_digest(file, package)
    (package / "deep" / "leaf.py").write_text("VALUE = 3\n")
    assert source_digest(file, package)[0] != before
