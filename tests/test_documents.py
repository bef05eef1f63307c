"""What the pages show works as shown."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import trackmark
from trackmark import bench, datasets, trackers
from trackmark.bench.execution.plan import make_plan
from trackmark.bench.experiments.experiment import read_experiment
from trackmark.bench.store.results import Results

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])


def blocks(page, language):
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_that_a_page_links_or_shows_is_there(page):
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        assert target.startswith("http") or (page.parent / target).is_file(), target


def test_every_file_that_a_page_or_the_code_names_is_there():
    tops = [top for top in ROOT.iterdir() if not top.name.startswith(".")]  # none in .venv
    there = [file for top in tops for file in (top, *top.rglob("*.*"))]
    ends = {"/".join(file.parts[-n:]) for file in there for n in range(1, 6)}
    ends |= {"trackers/nearest_colour.py", "tests/trackers/test_nearest_colour.py"}  # a recipe's
    packages = ("bench", "datasets", "reports", "trackers")
    code = [file for package in packages for file in (ROOT / package).rglob("*.py")]
    for file in (*PAGES, *code):
        named = set(re.findall(r"`([\w./-]+\.(?:py|toml|md))`", file.read_text()))
        assert not named - ends, f"{file}: {named - ends}"


def test_the_tracker_of_the_recipe_runs(tmp_path):
    file = tmp_path / "nearest_colour.py"
    file.write_text(next(block for block in blocks("CONTRIBUTING.md", "python") if "init" in block))
    name = f"{file}:NearestColour"
    run = bench.evaluate(f"{name}:preset=far", "samples/bow-tie")
    assert run.status == "finished", run.failure
    assert (run.details["distance"][1:] >= 0).all()
    about = trackers.describe(name)
    assert about["parameters"][0]["meaning"].endswith("[pixels]")


def test_the_cues_of_the_recipe_follow(tmp_path):
    (code,) = (block for block in blocks("CONTRIBUTING.md", "python") if "Chain(" in block)
    made = {}
    exec(compile(code, "cues.py", "exec"), made)
    position, size = made["position"], made["size"]
    assert position.weights @ position.states == pytest.approx(19.0, abs=1.5)
    assert size.weights @ size.states == pytest.approx(9.5, abs=1.5)


def test_the_reader_of_the_recipe_reads(tmp_path):
    import importlib.util

    import cv2

    (code,) = (block for block in blocks("CONTRIBUTING.md", "python") if "recognises" in block)
    file = tmp_path / "numbered.py"
    file.write_text(code)
    spec = importlib.util.spec_from_file_location("numbered", file)
    reader = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(reader)
    folder = tmp_path / "clip"
    folder.mkdir()
    assert not reader.recognises(folder)
    for i in range(3):
        cv2.imwrite(str(folder / f"{i}.png"), np.full((20, 30, 3), i, np.uint8))
    (folder / "boxes.txt").write_text("1 2 3 4\n" * 3)
    sequence = reader.read(folder, None)
    assert reader.recognises(folder)
    assert sequence.boxes.tolist() == [[1, 2, 3, 4]] * 3
    assert sequence[2].max() == 2


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_the_experiments_shown_can_be_planned(page, tmp_path):
    for number, block in enumerate(blocks(page, "toml")):
        if "sequences" not in tomllib.loads(block):  # an entry of a paper's file
            continue
        file = tmp_path / f"shown{number}.toml"
        file.write_text(block)
        assert len(make_plan(read_experiment(file), Results(tmp_path / "none")))


def test_the_python_of_the_readme_runs_as_it_stands(tmp_path, capsys):
    follower, image_to_box = blocks("README.md", "python")
    file = tmp_path / "follower.py"
    file.write_text(follower)
    run = bench.evaluate(str(file), "samples/bow-tie")
    assert run.status == "finished", run.failure
    assert (run.boxes[1:] == run.boxes[0]).all()
    exec(image_to_box, {})
    assert re.match(r"\[ *\d+\.?\d* .*\] True\n", capsys.readouterr().out)


def test_what_is_public_is_listed_and_typed_though_it_is_imported_late():
    source = Path(bench.__file__).read_text()
    for name in bench.__all__:
        assert name in dir(bench)
        assert re.search(rf"^    from [\w.]+ import .*\b{name}\b", source, re.MULTILINE)
        assert getattr(bench, name).__name__ == name
    assert trackmark.__all__ == bench.__all__
    assert trackmark.score is bench.score
    assert Path(trackmark.__file__).with_name("py.typed").is_file()


def test_the_readme_is_read_in_one_sitting():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 200


def test_the_python_of_the_pages_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bench.run(
        bench.Experiment(
            "windows", ("static",), (bench.experiments.experiment.SequenceSource("samples/face"),)
        )
    )
    sequence = datasets.load("samples/face")
    known = {
        "my_boxes": sequence.boxes,
        "image": sequence[0],
        "box": sequence.boxes[0],
        "empty_image": sequence[60],
        "half_axes": sequence.boxes[0, 2:] / 2,
        "doors": sequence.boxes[:1],
        "detector": lambda image: sequence.boxes[:1],
        "next_image": sequence[1],
        "frames_before": [sequence[60]] * 3,
        "frames_after": [sequence[0]] * 4 + [np.zeros_like(sequence[0])] * 8,
    }
    harness, filtering, revising = blocks("docs/python.md", "python")
    exec(harness, known)
    exec(filtering, known)
    assert known["estimate"].visible
    exec(revising, known)
    assert sorted(known["online"]) == sorted(known["in_the_end"]) == list(range(4, 16))
    assert min(known["revised"]) == 8  # where it is dark


def test_every_tracker_and_built_in_sequence_is_in_the_readme():
    text = (ROOT / "README.md").read_text()
    for name in trackers.names():
        short = name.removeprefix("opencv")
        assert f"`{name}`" in text or f"`{short}`" in text, name
    for suite, kind, first, last in re.findall(r"`(\w+)/(\w+)-(\d\d)` to `\w+-(\d\d)`", text):
        text += "".join(
            f"`{suite}/{kind}-{number:02d}`" for number in range(int(first), int(last) + 1)
        )
    for name in datasets.names():
        assert f"`{name}`" in text, name


def test_every_command_of_the_pages_exists():
    known = {file.stem for file in (ROOT / "bench" / "commands").glob("[!_]*.py")}
    for page in PAGES:
        code = "\n".join(re.findall(r"```.*?```|`[^`\n]+`", page.read_text(), re.DOTALL))
        shown = re.findall(r"(?:^|`|/)trackmark ([a-z-]+)", code, re.MULTILINE)
        assert set(shown) <= known, page.name


def test_every_make_goal_of_the_pages_exists():
    goals = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in PAGES:
        shown = re.findall(r"`make ([a-z-]+)|^make ([a-z-]+)", page.read_text(), re.MULTILINE)
        assert {a or b for a, b in shown} <= goals
