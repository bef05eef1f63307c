"""The recipe for a claim in CONTRIBUTING works as it stands there."""

import re
from pathlib import Path
from typing import Any

import pytest

from trackmark.bench.claims.claims_file import Claim, read_claims
from trackmark.bench.claims.row_verdicts import judge_row
from trackmark.bench.execution.executor import Execution
from trackmark.bench.papers import Effort
from trackmark.bench.papers.description import Description, read_description
from trackmark.bench.papers.evidence import evidence
from trackmark.bench.papers.measures import check_measure
from trackmark.bench.papers.plan import experiments, requests
from trackmark.bench.papers.runs import Context, StoredRuns

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def recipe() -> str:
    section = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("### A claim")[2]
    (claim,) = re.findall(r"```toml\n(.*?)```", section.partition("\n## ")[0], re.DOTALL)
    return str(claim)


@pytest.fixture
def claims(recipe: str, tmp_path: Path) -> dict[str, Claim]:
    path = tmp_path / "claims.toml"
    path.write_text(recipe, "utf-8")
    return read_claims("wang2010", path)


@pytest.fixture
def description() -> Description:
    """Return the description of wang2010 without main table and figures."""
    whole = read_description("wang2010")
    main = whole.main.model_copy(update={"rows": ()})
    return whole.model_copy(update={"figure": {}, "main": main})


def test_claim_of_contributing_is_planned(claims: Any, description: Description) -> None:
    (claim,) = claims.values()
    check_measure(claim.measure, "wang2010")
    (experiment,) = experiments(description, requests(description, claims, Effort()))
    assert (experiment.name, len(experiment.sequences)) == ("wang2010-hand", 12)


@pytest.mark.slow
def test_claim_is_judged_from_its_toml_alone(
    claims: Any, description: Description, tmp_path: Path
) -> None:
    requested = {}
    for experiment in experiments(description, requests(description, claims, Effort(seeds=1))):
        execution = Execution(experiment, tmp_path, jobs=1)
        assert list(execution.rows()) is not None
        requested[experiment.name] = execution.plan.manifest().versions
    runs = StoredRuns(tmp_path, requested, description)
    context = Context(description, claims, runs, tmp_path, Effort())
    (claim,) = claims.values()
    settings = ("as-written", "recommended")
    row = judge_row(claim, {name: evidence(claim, name, context) for name in settings})
    verdicts = [row.verdicts[name] for name in settings]
    assert [verdict.cells for verdict in verdicts] == [12, 12]
    assert all(verdict.effect.endswith("px, 12 scenes") for verdict in verdicts)
    assert verdicts[0].verdict == "holds"
