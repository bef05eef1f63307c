"""The recipe in CONTRIBUTING for a table and a claim works as it stands there."""

import re
import tomllib
from pathlib import Path

import pandas as pd
import pytest

from bench.claims.conclusion import conclude
from bench.claims.judging import judge
from bench.claims.ledger import read_claims
from bench.claims.sides import Table
from bench.experiments.experiment import ExperimentError
from bench.papers.description import read_description
from bench.papers.runs import labels_of
from bench.papers.tables import make_table

ROOT = Path(__file__).parents[3]
WANG = ROOT / "bench" / "papers" / "wang2010"


@pytest.fixture(scope="module")
def recipe():
    section = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("## A paper")[2]
    table, claim = re.findall(r"```toml\n(.*?)```", section.partition("## ")[0], re.DOTALL)
    return table, claim


@pytest.fixture(scope="module")
def runs():
    """Twelve scenes; the adaptive window has errors of 2 pixels and some, the fixed one of 4."""
    return pd.DataFrame(
        labels_of(f"camshift:window={window}", f"wang2010/table-tennis:scene={scene}")
        | {"repetition": 0, "frames": 50, "failure": "", "kept_scene": True, "copied": False}
        | {"error_1_16": error + scene / 1000, "path": f"{window}-{scene}"}
        for window, error in (("fixed", 4.0), ("adaptive", 2.0))
        for scene in range(12)
    )


def test_the_table_is_made_of_its_toml_alone(recipe, runs, tmp_path):
    file = tmp_path / "paper.toml"
    head = 'version = 1\ntitle = "t"\nexperiments = { always = ["a"] }\nframes_from = 1\n'
    file.write_text(head + recipe[0])
    description = read_description("trial", file)
    readings = next(iter(read_claims("wang2010").values())).readings
    frames, lookup = {"scores": runs}, Table(runs, readings)
    table = make_table("windows", description.table["windows"], frames, description, lookup)
    assert table.heads == ["tracker", "setting", "error 1-16 [px]", "runs"]
    shown = {row[1].text: [cell.text for cell in row[2:]] for row in table.rows}
    assert shown == {"—": ["4.0", "12"], "window=adaptive": ["2.0", "12"]}
    behind = [[set(files) for files in row] for row in table.runs]
    assert behind == [
        [{f"{window}-{n}" for n in range(12)}] * 2 for window in ("fixed", "adaptive")
    ]


def test_the_claim_is_judged_by_its_toml_alone(recipe, runs, tmp_path):
    file = tmp_path / "claims.toml"
    file.write_text((WANG / "claims.toml").read_text("utf-8") + "\n" + recipe[1])
    claim = read_claims(file)["WA-30"]
    assert conclude(claim, judge(claim, runs)).verdict == "holds"
    turned = runs.assign(error_1_16=6.0 - runs["error_1_16"])
    assert conclude(claim, judge(claim, turned)).verdict == "does not hold"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("columns = [", "colums = ["), "table.windows"),
        (('"mean", 1', '"mode", 1'), "table.windows.columns.0.as"),
        (('title = "t"', ""), "title: field required"),
        (("version = 1", "version = 2"), "version: input should be 1"),
    ],
)
def test_what_is_wrong_is_named_with_file_and_entry(recipe, change, words, tmp_path):
    file = tmp_path / "paper.toml"
    text = 'version = 1\ntitle = "t"\nexperiments = { always = ["a"] }\n' + recipe[0]
    assert change[0] in text
    file.write_text(text.replace(*change))
    with pytest.raises(ExperimentError) as raised:
        read_description("trial", file)
    assert f"{file}: " in str(raised.value)
    assert words in str(raised.value)
    assert tomllib.loads(text)["version"] == 1
