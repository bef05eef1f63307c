"""`trackmark reproduce` as a user types it."""

import json
import shutil

import pytest

from bench.papers import Effort, load_paper, paper_names


def one_line(done):
    """The only line of the error output."""
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1, done.stderr
    return lines[0]


def test_an_unknown_paper_gets_the_known_ones(trackmark):
    said = one_line(trackmark("reproduce", "multi-part", status=2))
    assert "unknown paper 'multi-part'" in said
    assert "Did you mean 'multipart'?" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "Give either --all-papers or one PAPER (moreno2005, "),
        (["multipart", "--all-papers"], "Give either --all-papers or one PAPER"),
        (["--all-papers", "--page", "page.md"], "--page goes with one PAPER"),
    ],
)
def test_one_paper_or_all_of_them(trackmark, arguments, words):
    assert words in trackmark("reproduce", *arguments, status=2).stderr


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("tracker,sequence\nCPF,Small\n", "no column 'eval'"),
        (
            "eval,tracker,sequence,mean_iou_overlapScores,success_at_0.5_from_errorNum\n"
            "OPE,CPF,Small,much,0.5\n",
            "could not convert",
        ),
    ],
)
def test_published_figures_that_cannot_be_read_are_said_before_anything_runs(
    trackmark, here, text, words
):
    (here / "figures.csv").write_text(text)
    arguments = ["--recorded", "data/Small", "--published", "figures.csv"]
    said = one_line(trackmark("reproduce", "multipart", *arguments, status=2))
    assert "figures.csv" in said
    assert words in said
    assert not (here / "results").exists()


def test_a_recorded_sequence_that_is_not_there_is_said_before_anything_runs(trackmark, here):
    done = trackmark("reproduce", "multipart", "--recorded", "data/None", status=2)
    assert "unknown sequence 'data/None'" in one_line(done)
    assert not (here / "results").exists()


@pytest.mark.parametrize("paper", paper_names())
@pytest.mark.parametrize("everything", [False, True])
def test_less_effort_is_part_of_more(paper, everything):
    module = load_paper(paper)
    whole = {e.name: e for e in module.experiments(Effort(everything=everything))}
    quick = {e.name: e for e in module.experiments(Effort(everything=everything, quick=True))}
    few = {e.name: e for e in module.experiments(Effort(everything=everything, seeds=1))}
    assert quick.keys() <= whole.keys() == few.keys()
    for name, experiment in quick.items():
        assert set(experiment.sequences) <= set(whole[name].sequences)
        assert set(experiment.trackers) <= set(whole[name].trackers)  # see `quick_without`
        assert max([experiment.repetitions, *experiment.repeated.values()]) <= 2
    for experiment in few.values():
        assert {experiment.repetitions, *experiment.repeated.values()} == {1}


@pytest.mark.slow
def test_a_quick_reproduction_answers_a_script_and_is_done_the_second_time(trackmark, here):
    arguments = ["reproduce", "multipart", "--quick", "--seeds", "1", "--json"]
    first = trackmark(*arguments)
    told = json.loads(first.stdout)
    assert told["paper"] == "multipart"
    assert told["title"].startswith("A quick look, no evidence: Adaptive multi-part")
    tested = [claim for claim in told["claims"] if claim["effect"]]
    assert all(claim["cells"] and claim["counted"] for claim in tested)
    table = next(t for t in told["tables"] if t["id"] == "1:first_loss:even")
    assert len(table["rows"]) == 24
    row = table["rows"][0]
    assert set(row) == {"label", "column", "published", "measured", "interval"}
    assert row["published"] == 736
    assert 1 <= row["measured"] <= 788
    ids = [claim["id"] for claim in told["claims"]]
    assert ids[:2] == ["MP-T1", "MP-1"]
    assert len(ids) == len(set(ids))
    outcomes = {"holds", "does not hold", "inconclusive", "not testable"}
    assert {claim["verdict"] for claim in told["claims"]} <= outcomes
    for name in ("report.md", "report.json", "figure-3.png", "figure-4.png", "scenes.csv"):
        assert (here / "results" / "multipart" / name).stat().st_size > 0, name
    second = trackmark(*arguments)
    assert json.loads(second.stdout)["claims"] == told["claims"]
    text = trackmark("reproduce", "multipart", "--quick", "--seeds", "1").stdout
    assert text.startswith("A quick look, no evidence: Adaptive multi-part")
    page = (here / "results" / "multipart" / "report.md").read_text()
    assert page.startswith("# A quick look, no evidence: ")
    assert len(text.splitlines()) <= 90
    assert max(map(len, text.splitlines())) <= 100
    assert "trackmark reproduce multipart\n" in text


@pytest.mark.slow
def test_a_lost_run_is_run_again_and_strict_says_no_where_a_claim_does_not_hold(trackmark, here):
    arguments = ["reproduce", "multipart", "--quick", "--seeds", "1"]
    claims = json.loads(trackmark(*arguments, "--json").stdout)["claims"]
    folder = next((here / "results" / "multipart-table-1").glob("multipart*"))
    shutil.rmtree(folder)
    assert json.loads(trackmark(*arguments, "--json").stdout)["claims"] == claims
    fails = [claim for claim in claims if claim["verdict"] == "does not hold"]
    trackmark(*arguments, "--strict", status=1 if fails else 0)
