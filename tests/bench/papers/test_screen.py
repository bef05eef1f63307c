"""What a reproduction prints, and what it writes into a paper's page."""

import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from bench.claims.judging import NOT_RUN
from bench.papers import Effort, Report, load_paper
from bench.papers.page import BEGIN, END, write_page
from bench.papers.screen import screen
from bench.papers.selection import more_scenes, more_to_run
from bench.store.files import ResultsError
from reports.tables import Cell, Table


def claim(name, verdict, text="The target is tracked.", readings="7 of 9", **evidence):
    tested = verdict != "not testable" and "reason" not in evidence
    effect = "on target: 0.85 [0.62, 0.96] of the runs, 20 scenes" if tested else ""
    return {
        "effect": effect,
        "id": name,
        "source": "Section 3",
        "text": text,
        "verdict": verdict,
        "readings": readings,
        "evidence": {"fragile": False, "asserted": False, "ours": False, "reason": ""}
        | {"post_hoc": "1 of 2" if readings else ""}
        | evidence,
    }


@pytest.fixture
def report():
    table = Table(
        name="table-1",
        caption="Table 1, other videos",
        heads=["features", "tracked", "paper"],
        n_labels=1,
        rows=[[Cell("RGB"), Cell("17.7"), Cell("16")]],
        data=pd.DataFrame(),
    )
    claims = [
        claim("NG-1", "holds"),
        claim("NG-2", "does not hold", "word " * 30, fragile=True) | {"short": "lost | at once"},
        claim("NG-T1", "not testable", readings=""),
        claim("NG-4", "holds", "word " * 30),
        claim("NG-5", "inconclusive", reason=f"{NOT_RUN}."),
    ]
    main = [table, replace(table, caption="On the page alone")]
    return Report("Template tracking", ["a remark"], [table], [], claims, main=main)


def test_the_screen_has_the_main_table_a_line_a_claim_and_where_the_rest_is(report):
    lines = screen(report, "nguyen2002", Effort(), Path("results/nguyen2002")).splitlines()
    assert lines[0] == "Template tracking"
    assert ["RGB", "17.7", "16"] in [line.split() for line in lines]
    assert "5 claims: 2 holds, 1 does not hold, 1 not testable, 1 not run" in lines
    (first, second, third, fourth, fifth) = (line for line in lines if line.startswith("NG-"))
    assert lines[lines.index(first) + 1] == f"        {report.claims[0]['effect']}"
    assert lines[lines.index(third) + 1] == fourth
    assert re.fullmatch(r"NG-1 +The target is tracked\. +holds +7 of 9 readings", first)
    assert second.split("does not hold ")[-1] == "7 of 9 readings, fragile"
    assert "lost | at once" in second
    assert third.endswith("not testable")
    assert "word …" in fourth
    assert fifth.endswith("not run")
    assert max(map(len, lines)) <= 100
    assert any("results/nguyen2002/report.html" in line for line in lines)
    assert lines[-1].endswith("trackmark reproduce nguyen2002 --all")
    assert "a remark" not in lines
    assert "On the page alone" not in lines


def test_screen_prints_the_reason_of_an_inconclusive_verdict(report):
    reason = "interval contains 0; about 75 scenes needed"
    report.claims.append(
        claim("NG-6", "inconclusive") | {"effect": "0.03 [-0.01, 0.07], 20 scenes"}
    )
    report.claims[-1]["evidence"]["reason"] = reason
    lines = screen(report, "nguyen2002", Effort(), Path("r")).splitlines()
    assert f"        0.03 [-0.01, 0.07], 20 scenes: {reason}" in lines


def test_a_claim_that_is_ours_is_shown_and_not_counted(report, tmp_path):
    report.claims[0]["evidence"]["ours"] = True
    printed = screen(report, "nguyen2002", Effort(), Path("r"))
    assert "4 claims: 1 does not hold, 1 not testable, 1 holds, 1 not run; 1 of ours" in printed
    assert re.search(r"NG-1 .* holds +7 of 9 readings, ours\n", printed)
    write_page(tmp_path / "page.md", report, "nguyen2002", Effort())
    assert "The target is tracked. (ours, not the paper's) |" in (tmp_path / "page.md").read_text()


@pytest.mark.parametrize(
    ("name", "effort", "words"),
    [
        ("MP-10", Effort(), "give --all"),  # of another model of motion
        ("MP-10", Effort(everything=True), ""),
        ("MP-8", Effort(quick=True), "leave out --quick"),
        ("MP-8", Effort(), ""),
        ("MP-4a", Effort(quick=True), "leave out --quick"),  # though --all has more readings
    ],
)
def test_all_is_advised_only_where_it_would_run_what_is_missing(name, effort, words):
    paper = load_paper("multipart")
    assert more_to_run(paper.claims[name], paper.description, effort) == words


def test_all_is_advised_for_more_scenes_and_says_what_equality_takes():
    paper = load_paper("nguyen2002")
    sets, equal = paper.claims["NG-6"], paper.claims["NG-22"]
    sets = sets.model_copy(update={"experiment": ("nguyen2002-table-1", "nguyen2002-more-sets")})
    assert more_scenes(sets, paper.description, Effort()) == "give --all for more"
    assert more_scenes(sets, paper.description, Effort(everything=True)) == ""
    assert more_scenes(equal, paper.description, Effort()) == ""
    words = "give --all; that no difference matters takes 30 scenes or more"
    assert more_to_run(equal, paper.description, Effort()) == words


def test_a_quick_look_is_marked_and_says_what_gives_evidence(report):
    lines = screen(report, "nguyen2002", Effort(quick=True), Path("r")).splitlines()
    assert lines[1] == "MARKED: a quick look, no evidence: few scenes and seeds."
    assert lines[-1].endswith("trackmark reproduce nguyen2002")


def test_a_page_is_begun_and_its_prose_survives_what_is_written_again(report, tmp_path):
    page = tmp_path / "docs" / "nguyen2002.md"
    write_page(page, report, "nguyen2002", Effort(seeds=2))
    begun = page.read_text()
    assert begun.startswith("# Template tracking\n")
    assert begun.count("| RGB | 17.7 | 16 |") == 2
    assert "`trackmark reproduce nguyen2002 --seeds 2` found (at most 2 repetitions)" in begun
    told = "on target: 0.85 [0.62, 0.96] of the runs, 20 scenes | 7 of 9; post hoc 1 of 2"
    assert f"| NG-1 | The target is tracked. | holds | {told} |" in begun
    assert f"| does not hold | {told}; fragile |" in begun
    assert begun.count("| not run | — | — |") == 1
    page.write_text(
        begun.replace("What the paper says, in a paragraph.", "Prose.") + "More prose.\n"
    )
    report.claims[0]["verdict"] = "inconclusive"
    write_page(page, report, "nguyen2002", Effort())
    again = page.read_text()
    assert f"| inconclusive | {told} |" in again
    assert again.count("NG-1 ") == 1
    assert "Prose." in again
    assert again.endswith("More prose.\n")
    assert again.index(BEGIN) < again.index("NG-1 ") < again.index(END)


def test_a_page_without_marks_is_left_as_it_is(report, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Mine\n")
    with pytest.raises(ResultsError, match=r"page\.md: there are no two lines"):
        write_page(page, report, "nguyen2002", Effort())
    assert page.read_text() == "# Mine\n"
