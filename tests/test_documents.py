"""Commands, programs and links of the pages work as shown."""

import ast
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import click
import numpy as np
import pytest

import trackmark
from tools import paper_history
from trackmark import datasets, trackers
from trackmark.bench.cli import trackmark as program
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.execution.plan import make_plan
from trackmark.bench.experiments.experiment import read_experiment
from trackmark.bench.store.run_store import RunStore

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])


HANG = """
import time

from trackmark import trackers


class Hang(trackers.TrackerPlugin):
    def init(self, image, box, mask=None):
        self.box, self.frame = box.copy(), 0

    def update(self, image):
        self.frame += 1
        if self.frame == 40:
            time.sleep(1000)
        return trackers.Estimate(self.box.copy())
"""
"""Tracker of docs/results.md that hangs at frame 40."""


def blocks(page, language=""):
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", (ROOT / page).read_text(), re.DOTALL | re.M)
    return [block for marked, block in fenced if marked == language]


def transcripts(page):
    """Yield commands behind a prompt, each with the lines that the page shows as its output."""
    for block in blocks(page):
        for command in re.split(r"^\$ ", block, flags=re.M)[1:]:
            line, *output = command.splitlines()
            yield line, [text for text in output if text.strip() not in ("", "…")]


def normalise(text):
    """Return a line without its spacing, and with a sign in the place of times and machines."""
    text = re.sub(r"(?<=^ms/frame on ).*", "MACHINE", text)
    text = re.sub(
        r"~[\d.]+(?: +[\d.]+)?$|~?\d+\.\d+$|(?<=took )[\d.]+ .s|[\d.]+ (?:ms|s|min)\b",
        "TIME",
        text.rstrip(),
    )
    text = re.sub(r"about \d+ times", "N times", text)
    text = re.sub(r'(?<=File ").*/(?=hang.py")', "", text)
    return re.sub(r"-{2,}", "-", " ".join(text.split()))


def run_transcripts(page, folder):
    """Run the commands of a page in order; each line that the page shows must be printed."""
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    for command, expected in transcripts(page):
        done = subprocess.run(
            ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True
        )
        printed = {normalise(line) for line in (done.stdout + done.stderr).splitlines()}
        missing = [line for line in expected if normalise(line) not in printed]
        assert not missing, (command, missing, done.stdout[-5000:], done.stderr[-2000:])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_pages_link_to_existing_files(page):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        assert target.startswith("http") or (page.parent / target).is_file(), target


def test_files_named_by_pages_and_code_exist():
    tops = [top for top in ROOT.iterdir() if not top.name.startswith(".")]  # none in .venv
    files = [file for top in tops for file in (top, *top.rglob("*.*"))]
    ends = {"/".join(file.parts[-n:]) for file in files for n in range(1, 6)}
    # Files of recipes and of the tutorial.
    ends |= {"trackers/nearest_colour.py", "tests/trackers/test_nearest_colour.py", "matcher.py"}
    packages = ("bench", "datasets", "reports", "trackers")
    code = [file for package in packages for file in (ROOT / package).rglob("*.py")]
    for file in (*PAGES, *code):
        named = set(re.findall(r"`([\w./-]+\.(?:py|toml|md))`", file.read_text()))
        assert not named - ends, f"{file}: {named - ends}"


def test_contributing_tracker_runs(tmp_path):
    file = tmp_path / "nearest_colour.py"
    file.write_text(next(block for block in blocks("CONTRIBUTING.md", "python") if "init" in block))
    name = f"{file}:NearestColour"
    run = evaluate_run(f"{name}:preset=far", "samples/bow-tie")
    assert run.status == "finished", run.failure
    assert (run.details["distance"][1:] >= 0).all()
    about = trackers.describe(name)
    assert about["parameters"][0]["meaning"].endswith("[pixels]")
    with pytest.raises(trackers.TrackerError, match="box"):
        trackers.create(name, seed=0).init(datasets.load("samples/bow-tie")[0], (20, 20, 12, 0))


def test_contributing_cues_follow_the_observation(tmp_path):
    (code,) = (block for block in blocks("CONTRIBUTING.md", "python") if "Chain(" in block)
    names = {}
    exec(compile(code, "cues.py", "exec"), names)
    position, size = names["position"], names["size"]
    assert position.weights @ position.states == pytest.approx(19.0, abs=1.5)
    assert size.weights @ size.states == pytest.approx(9.5, abs=1.5)


@pytest.mark.parametrize(
    ("page", "images", "truth", "row", "box"),
    [
        ("CONTRIBUTING.md", "walk/{}.png", "walk/boxes.txt", "1 2 3 4\n", [0, 1, 3, 4]),
        (
            "docs/datasets.md",
            "shots/walk/cam_000{}.png",
            "boxes/walk.txt",
            "1,1,2,4,6,0\n",
            [1, 2, 3, 4],
        ),
    ],
)
def test_layout_of_a_page_reads(page, images, truth, row, box, tmp_path, monkeypatch):
    import cv2

    from trackmark.datasets.layouts import LAYOUT_VARIABLE

    (code,) = (block for block in blocks(page, "toml") if "truth = " in block)
    (tmp_path / "mine.toml").write_text(code)
    monkeypatch.setenv(LAYOUT_VARIABLE, str(tmp_path / "mine.toml"))
    for file in (images, truth):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    for number in (1, 2, 3):
        image = np.full((20, 30, 3), number, np.uint8)
        cv2.imwrite(str(tmp_path / images.format(number)), image)
    (tmp_path / truth).write_text(row)
    sequence = datasets.load(tmp_path / "walk")
    assert sequence.boxes[0].tolist() == box
    assert sequence.annotated.tolist() == [True, False, False]
    assert sequence[2].max() == 3


def test_layout_table_of_the_page_is_current():
    from tools.layout_table import PAGE, updated

    assert PAGE.read_text("utf-8") == updated(PAGE.read_text("utf-8"))


@pytest.mark.slow
def test_example_notebook_runs_and_displays_the_answer():
    notebook = json.loads((ROOT / "docs/example.ipynb").read_text())
    names, displayed = {}, []
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        *statements, last = ast.parse("".join(cell["source"])).body
        if not isinstance(last, ast.Expr):
            statements, last = [*statements, last], None
        exec(compile(ast.Module(statements, []), "example.ipynb", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "example.ipynb", "eval"), names)
            displayed.append(value._repr_html_())
    sequence, means, comparison, run = displayed
    assert re.match(r"<p><b>.*Matcher.*?</b></p>.*<table>", comparison)
    assert "<td>Matcher</td>" in means
    assert sequence.count("<img") == run.count("<img") == 1


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_experiments_of_pages_can_be_planned(page, tmp_path):
    for number, block in enumerate(blocks(page, "toml")):
        if "sequences" not in tomllib.loads(block):  # an entry of a paper's file
            continue
        file = tmp_path / f"shown{number}.toml"
        file.write_text(block)
        assert len(make_plan(read_experiment(file), RunStore(tmp_path / "none")))


def test_readme_tracker_runs(tmp_path, monkeypatch):
    (program_text,) = blocks("README.md", "python")
    (tmp_path / "matcher.py").write_text(program_text)
    monkeypatch.syspath_prepend(tmp_path)
    names = {"tm": trackmark}
    exec("from matcher import Matcher", names)
    (code,) = re.findall(r"`(tm\.evaluate.*?)`", (ROOT / "README.md").read_text())
    means = eval(code, names)["mean_overlap"]
    assert [f"{mean:.2f}" for mean in means] == ["0.74", "0.67", "0.57"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [page for page in PAGES if any(transcripts(page))], ids=lambda page: page.stem
)
def test_commands_print_the_output_of_the_page(page, tmp_path):
    for name, program_text in {
        "matcher": (blocks(page, "python") or [""])[0],
        "hang": HANG,
    }.items():
        (tmp_path / f"{name}.py").write_text(program_text)
    run_transcripts(page, tmp_path)


def test_commands_of_pages_have_valid_options():
    with click.Context(program) as context:
        for page in PAGES:
            for block in blocks(page):
                for line in re.findall(r"^(?:\$ )?trackmark (.+)$", block, re.M):
                    for command in line.replace("; trackmark ", "\n").splitlines():
                        name, *arguments = shlex.split(command.replace("…", "x"), comments=True)
                        problem = ""
                        try:
                            program.get_command(context, name).make_context(name, arguments)
                        except click.UsageError as error:
                            problem = error.format_message()
                        # Files of the examples need not exist.
                        assert not problem or "does not exist" in problem, (page, command, problem)


def test_public_names_are_listed_and_typed():
    source = Path(trackmark.__file__).read_text()
    for name in trackmark.__all__:
        assert name in dir(trackmark)
        assert re.search(rf"^    from [\w.]+ import .*\b{name}\b", source, re.MULTILINE)
        assert getattr(trackmark, name).__name__.rpartition(".")[2] == name
    assert Path(trackmark.__file__).with_name("py.typed").is_file()


def test_readme_has_at_most_180_lines_of_120_columns():
    lines = (ROOT / "README.md").read_text("utf-8").splitlines()
    assert len(lines) <= 180
    assert max(map(len, lines)) <= 120


def test_python_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    *alone, filtering, revising = blocks("docs/python.md", "python")
    own_class = re.search(r"class MyTracker.*?return self\.box\n", alone[0], re.DOTALL)[0]
    (tmp_path / "my_tracker.py").write_text(own_class)
    for block in alone:  # each block runs without the others
        exec(block, values := {})
        for expression, expected in re.findall(
            r"^(\S.*)  # (?:.*?camshift )?(0\.\d+)$", block, re.M
        ):
            result = eval(expression, values)
            result = result if isinstance(result, float) else result["camshift"]
            assert f"{result:.3f}" == expected, expression
    sequence = datasets.load("samples/face")
    names = {
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
    exec(filtering, names)
    assert names["estimate"].visible
    exec(revising, names)
    assert sorted(names["online"]) == sorted(names["final"]) == list(range(4, 16))
    assert min(names["revised"]) == 8  # in the black frames
    (attributes,) = blocks("docs/attributes.md", "python")
    exec(attributes, {})


def test_catalogue_has_all_trackers_and_sequences():
    text = (ROOT / "docs" / "catalogue.md").read_text()
    for name in trackers.names():
        short = name.removeprefix("opencv")
        assert f"`{name}`" in text or f"`{short}`" in text, name
    for suite, kind, first, last in re.findall(r"`(\w+)/(\w+)-(\d\d)` to `\w+-(\d\d)`", text):
        text += "".join(
            f"`{suite}/{kind}-{number:02d}`" for number in range(int(first), int(last) + 1)
        )
    for name in datasets.names():
        assert f"`{name}`" in text, name


def test_history_page_has_the_histories_of_all_papers():
    assert paper_history.PAGE.read_text("utf-8") == paper_history.page()


def test_commands_of_pages_exist():
    commands = {file.stem for file in (ROOT / "bench" / "commands").glob("[!_]*.py")}
    for page in PAGES:
        code = "\n".join(re.findall(r"```.*?```|`[^`\n]+`", page.read_text(), re.DOTALL))
        shown_commands = re.findall(r"(?:^|`|/)trackmark ([a-z-]+)", code, re.MULTILINE)
        assert set(shown_commands) <= commands, page.name


def test_make_goals_of_pages_exist():
    goals = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in PAGES:
        shown_goals = re.findall(r"`make ([a-z-]+)|^make ([a-z-]+)", page.read_text(), re.MULTILINE)
        assert {a or b for a, b in shown_goals} <= goals
