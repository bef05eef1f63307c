"""Numbers stand with their units beneath each other, texts to the left, whatever the format."""

import shutil
import subprocess

import pytest

from trackmark.reports.renderers import to_latex, to_markdown, to_text
from trackmark.reports.tables import Cell, Table, number_in, texts_of

SCORES = ["0.784 ±0.204", "0.103 [0.000, 0.210]", "0.929"]
COUNTS = ["7 of 119", "118.7 ±0.6 of 119", "119 of 119"]
VERDICTS = ["better", "inconclusive", "worse"]
PS = ["< .001", ".047", "1"]


@pytest.fixture
def table():
    columns = zip("abc", SCORES, COUNTS, VERDICTS, PS, strict=True)
    rows = [[Cell(text, text == "119 of 119") for text in row] for row in columns]
    rows.append([Cell("none"), Cell("— (1 of 1 failed)"), *[Cell("—")] * 3])
    return Table("t", "", ["tracker", "overlap", "success", "the first is", "p"], 1, rows)


@pytest.mark.parametrize(
    ("text", "whole"),
    [("-0.5", "-0"), ("[-12.3, 4]", "[-12"), (".047", ""), ("< .001", "< "), ("7 of 9", "7"),
     ("~3.1", "~3"), ("1e-5", "1"), ("2026-11-23", None), ("294f9", None), ("—", None), ("", None)],
)  # fmt: skip
def test_a_number_is_parted_at_its_units(text, whole):
    number = number_in(text)
    assert number is None if whole is None else number == (whole, text.removeprefix(whole))


def test_units_stand_beneath_each_other_as_text(table):
    assert to_text(table).splitlines()[2:] == [
        "tracker               overlap            success   the first is       p",
        "-------  --------------------  ------------------  ------------  ------",
        "a        0.784 ±0.204            7 of 119          better        < .001",
        "b        0.103 [0.000, 0.210]  118.7 ±0.6 of 119   inconclusive    .047",
        "c        0.929                 119 of 119*         worse          1",
        "none        — (1 of 1 failed)                  —   —                  —",
    ]


def test_units_stand_beneath_each_other_in_latex(table, tmp_path):
    text = to_latex(table)
    assert r"\begin{tabular}{lr@{}lr@{}llr@{}l}" in text
    assert r"a & 0 & .784 $\pm$0.204 & 7 & ~of 119 & better" in text
    assert r"\textbf{119} & \textbf{~of 119}" in text
    assert r"tracker & \multicolumn{2}{r}{overlap} & \multicolumn{2}{r}{success} & the" in text
    if shutil.which("pdflatex") is None:
        pytest.skip("pdflatex is not installed")
    packages = r"\documentclass{article}\usepackage{booktabs}"
    (tmp_path / "t.tex").write_text(rf"{packages}\begin{{document}}{text}\end{{document}}")
    command = ["pdflatex", "-halt-on-error", "-draftmode", "-no-shell-escape", "t.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
    assert done.returncode == 0, done.stdout[-900:]


def test_columns_of_markdown_stand_left_or_right(table):
    assert "| --- | ---: | ---: | --- | ---: |" in to_markdown(table)


def test_several_statements_are_a_text_also_where_numbers_begin_them():
    rows = [[Cell("a"), Cell("0 of 2")], [Cell("b"), Cell("1 of 4; post hoc 2 of 4; fragile")]]
    assert texts_of(Table("t", "", ["claim", "holds in"], 1, rows)) == [True, True]
    assert texts_of(Table("t", "", ["claim", "holds in"], 1, rows[:1])) == [True, False]
