"""Pages of the papers: order, length, equal units, pictures and sums."""

import re
from pathlib import Path

import pytest
from PIL import Image

from tools import paper_sums
from trackmark.bench.papers import SETTINGS, paper_names
from trackmark.bench.papers.main_table import MainCell
from trackmark.bench.papers.markdown_page import details_file, section_text
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.sections import (
    DECIDED,
    DIFFERS,
    REAL_VIDEO,
    WITHOUT_CLAIM,
    Section,
    chain_section,
    read_notes,
)
from trackmark.bench.papers.tables import choice_table

FOLDER = Path(__file__).parents[1] / "docs" / "papers"
PICTURES = FOLDER.parent / "pictures" / "papers"
PAPERS = pytest.mark.parametrize("paper", paper_names())

MAX_WORDS = 1500
MAX_CELL_WORDS = 12  # of a verdict, with its reason
MAX_FILE, MAX_FILES = 150_000, 1_200_000  # bytes of a picture, and of all pictures
NUMBER = r"(?:≤ )?\d+(?:\.\d)?|none|—"
CELL = re.compile(rf"(?:{NUMBER})(?: / (?:{NUMBER}))*(?: of \d+)?")


def visible_words(markdown):
    """Return the words that a reader sees, without marks and the addresses of links."""
    text = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", markdown)
    return [word for word in re.sub(r"[|*`#]", " ", text).split() if re.search(r"\w", word)]


def read(paper):
    return (FOLDER / f"{paper}.md").read_text("utf-8")


def units(cell):
    """Return the number of values of a cell, and whether they are counted of a total."""
    parsed = MainCell.parse(cell)
    return len(parsed.values), bool(parsed.total)


@PAPERS
def test_rows_of_the_paper_have_one_unit(paper):
    for row in read_paper(paper).main_table.rows:
        if row.paper == "–":
            continue
        assert CELL.fullmatch(row.paper), row.paper
        if row.function:
            continue
        n_values = 1 if row.compares else len(row.trackers) * len(row.measures)
        assert units(row.paper) == (n_values, True)
        assert MainCell.parse(row.paper).total == str(row.total or 1)


@PAPERS
def test_claims_of_the_main_table_exist(paper):
    content = read_paper(paper)
    named = {name for row in content.main_table.rows for name in row.claims if name}
    assert named <= content.claims.keys()


@PAPERS
def test_answer_is_one_short_sentence(paper):
    finding = read_paper(paper).finding
    assert len(finding.split()) <= 30
    assert finding.count(". ") == 0


@pytest.mark.parametrize(("heading", "bullets", "words"), [(DIFFERS, 5, 200), (DECIDED, 4, 100)])
@PAPERS
def test_notes_are_short(paper, heading, bullets, words):
    text = read_notes(paper)[heading]
    assert 1 <= len(re.findall(r"^- ", text, re.M)) <= bullets
    assert len(visible_words(text)) <= words


@PAPERS
def test_page_is_short_and_in_order(paper):
    text = read(paper)
    assert len(visible_words(text)) <= MAX_WORDS
    headings = re.findall(r"^## (.*)$", text, re.M)
    assert headings == [
        "The paper's results and ours", "Pictures", "Verdicts", DIFFERS, REAL_VIDEO,
        "From the text to the default", DECIDED, "How to run it",
    ]  # fmt: skip
    assert text.count(read_paper(paper).finding) == 1
    for setting in SETTINGS:
        assert f"- {setting}: Main results reproduced: " in text.partition("\n## ")[0]


@PAPERS
def test_pages_have_the_present_notes_and_values(paper):
    content, notes = read_paper(paper), read_notes(paper)
    sections = [Section("", heading, [notes[heading]]) for heading in (DIFFERS, DECIDED)]
    for section in (*sections, chain_section(content)):
        assert section_text(section) in read(paper)
    assert f"\n\n{content.main_table.caption} Ours: " in read(paper)
    details = details_file(FOLDER / f"{paper}.md").read_text("utf-8")
    choices = Section("", "Choices of the trackers", tables=[choice_table(content)])
    for section in (Section("", WITHOUT_CLAIM, [notes[WITHOUT_CLAIM]]), choices):
        assert section_text(section) in details


@PAPERS
def test_our_cells_have_the_units_of_the_paper(paper):
    table = read(paper).partition("\n## The paper's results and ours")[2].partition("\n## ")[0]
    rows = [line.strip("| ").split(" | ") for line in table.splitlines() if line.startswith("| ")]
    n_labels = len(read_paper(paper).main_table.headings)
    assert len(rows) > 2
    for row in rows[2:]:
        theirs, *ours = [cell.strip() for cell in row[n_labels:]]
        assert all(CELL.fullmatch(cell) for cell in ours), row
        assert theirs == "–" or {units(cell) for cell in ours} == {units(theirs)}, row


@PAPERS
def test_cells_of_verdicts_are_short_and_have_one_unit(paper):
    table = read(paper).partition("\n## Verdicts")[2].partition("\n## ")[0]
    rows = [line.strip("| ").split(" | ") for line in table.splitlines() if line.startswith("| ")]
    claims = read_paper(paper).claims
    assert [row[0] for row in rows[2:]] == [*claims]
    for name, summary, unit, theirs, *ours in rows[2:]:
        assert (summary, theirs) == (claims[name].summary, claims[name].paper)
        assert all(len(cell.split()) <= MAX_CELL_WORDS for cell in (unit, theirs, *ours)), name
        is_share = claims[name].test == "share"
        assert theirs.startswith("1 of 1, ") == is_share == (unit in {"scenes", "sets"}), name


@PAPERS
def test_pictures_of_a_page_exist_and_have_texts(paper):
    pictures = re.findall(r"!\[(.+)\]\((.+)\)", read(paper))
    assert len(pictures) == len(read_paper(paper).pictures) >= 1
    for text, address in pictures:
        file = FOLDER / address
        assert file.stat().st_size <= MAX_FILE
        with Image.open(file) as picture:
            assert picture.width >= 600
        assert len(text.split()) >= 5


def test_pictures_are_referenced_and_small():
    files = sorted(PICTURES.glob("*"))
    named = {address.rpartition("/")[2] for paper in paper_names()
             for address in re.findall(r"!\[.+\]\((.+)\)", read(paper))}  # fmt: skip
    assert {file.name for file in files} == named
    assert sum(file.stat().st_size for file in files) <= MAX_FILES


@PAPERS
def test_page_and_its_details_link_to_each_other(paper):
    details = details_file(FOLDER / f"{paper}.md")
    assert f"]({details.name})" in read(paper)
    assert f"]({paper}.md)" in details.read_text("utf-8")


def test_readme_has_the_sums_of_all_pages():
    assert paper_sums.readme() == paper_sums.README.read_text("utf-8"), (
        "Run: python -m tools.paper_sums"
    )
    for paper in paper_names():
        sums = paper_sums.sums(FOLDER / f"{paper}.md")
        assert all(re.match(r"\d+ of \d+ \(", text) for text in sums)
