"""Renderers of tables: marks, alignment, and names that other programs would evaluate."""

import io
import json
import shutil
import subprocess

import pandas as pd
import pytest

from trackmark.reports.renderers import to_csv, to_json, to_latex, to_markdown, to_text
from trackmark.reports.tables import Cell, Table, text_columns


def scores(*rows, title="T", notes=()):
    """Return a table of trackers and overlaps, in which the highest overlap has a mark."""
    highest = max(overlap for _, overlap in rows)
    cells = [[Cell(name), Cell(f"{value:.3f}", value == highest)] for name, value in rows]
    data = pd.DataFrame(rows, columns=["tracker", "mean"])
    return Table("t", f"{title}: means", ["tracker", "overlap"], 1, cells, [*notes], data)


@pytest.fixture
def table():
    odd, missing = r"odd|_*&%$#{}~^\<", "— (1 of 1 failed)"
    rows = [
        [Cell("static"), Cell("0.250"), Cell("12.0")],
        [Cell("camshift:hue_bins=16"), Cell("0.750", is_best=True), Cell("3.2", is_best=True)],
        [Cell(odd), Cell(missing), Cell(missing)],
    ]
    headings = ["tracker", "overlap", "error [px]"]
    return Table("t", "A & B_c: means", headings, 1, rows, [f"{odd}: 1 of 1 runs failed"])


def test_text_is_aligned_and_has_marks(table):
    assert to_text(table).splitlines()[2:] == [
        "tracker                         overlap          error [px]",
        "--------------------  ------------------  ------------------",
        "static                            0.250                12.0",
        "camshift:hue_bins=16              0.750*                3.2*",
        "odd|_*&%$#{}~^\\<      — (1 of 1 failed)   — (1 of 1 failed)",
        "odd|_*&%$#{}~^\\<: 1 of 1 runs failed",
    ]


def test_text_aligns_wide_characters():
    table = scores(("追跡", 0.5), ("abcd", 0.25))
    lines = to_text(table).splitlines()[4:]
    assert lines == ["追跡       0.500*", "abcd       0.250"]


def test_markdown_has_as_many_cells_in_every_row(table):
    lines = [line for line in to_markdown(table).splitlines() if line.startswith("|")]
    unescaped = [line.replace("\\\\", "").replace("\\|", "") for line in lines]
    assert {line.count("|") for line in unescaped} == {4}
    assert "**0.750**" in lines[3]


NAMES = ["=1+1", "@SUM(A1)", "-2 px", "+x", "'=1", "''-x", "-3", "'quoted'", "a-b", "-1e5", "—"]
NAMES += ["＝1+1", "-inf", "-1_0", "\t=1"]


def test_csv_headings_are_not_formulas():
    table = Table("t", "", ["sequence", "=1+1"], 1, [], records=pd.DataFrame({"=1+1": [-0.5]}))
    assert to_csv(table).splitlines() == ["'=1+1", "-0.5"]


@pytest.mark.parametrize("name", NAMES)
def test_csv_protects_formulas_as_documented(name):
    table = scores((name, -0.5))
    text = to_csv(table)
    row = text.splitlines()[1]
    assert not row.lstrip('"').startswith(("=", "@", "+", "＝", "\t"))
    assert row.endswith(",-0.5")
    back = pd.read_csv(io.StringIO(text), dtype={"tracker": str})
    (tracker,) = back["tracker"].str.replace(r"^'(?='*[=+@＝＋＠－-])", "", regex=True)
    assert tracker == name.replace("\t", r"\u0009")
    assert back["mean"].tolist() == [-0.5]


@pytest.mark.parametrize("render", [to_csv, to_latex, to_markdown, to_text])
def test_name_stays_in_its_line_and_cell(render):
    plain, odd = (
        render(scores((name, 0.5), title=f"T {name}", notes=[name]))
        for name in ("name", "na\nme\r| \x1b[2J\u2028")
    )
    assert len(odd.splitlines()) == len(plain.splitlines())
    assert odd.isprintable() or set(filter(lambda sign: not sign.isprintable(), odd)) == {"\n"}
    assert r"\u000a".replace("\\", r"\textbackslash{}" if render is to_latex else "\\") in odd


@pytest.mark.parametrize(
    ("name", "escaped"),
    [
        ("[x](javascript:alert)", r"\[x\](javascript:alert)"),
        ("a [x][y]", r"a [x\][y]"),
        ("<script>&lt; & ~~x~~", r"\<script>\&lt; & \~\~x\~\~"),
        ("![x](y)", r"![x\](y)"),
        ("error [px]", "error [px]"),
    ],
)
def test_markdown_escapes_names(name, escaped):
    assert f"| {escaped} |" in to_markdown(scores((name, 0.5)))


@pytest.mark.parametrize("name", ["[x]", "*x"])
def test_latex_protects_names_from_options(name):
    rows = to_latex(scores((name, 0.5))).splitlines()
    assert rf"{{}}{name} & \textbf{{0.500}} \\" in rows


def test_latex_escapes_commands(table):
    text = to_latex(table)
    assert r"\caption{A \& B\_c:" in text
    assert r"odd\textbar{}\_*\&\%\$\#\{\}\textasciitilde{}\textasciicircum{}" in text
    assert r"\textbackslash{}\textless{}" in text
    assert r"\textbf{0.750}" in text
    body = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert {line.replace(r"\&", "").count("&") for line in body} == {2}


HARMFUL = [
    "ключ 跟踪 شَيْء 🎯 e\u0301",
    "".join(map(chr, [*range(0x20, 0x250), *range(0x2010, 0x2050), 0x2192, 0x2264, 0xFFFD])),
    r"\input{/etc/hostname} \end{tabular} ^^5cfoo %\csname",
    "two\nlines\r\x1b[2J\u202e",
    "[*x]",
]


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_compiles_with_any_names(table, aligned, tmp_path):
    harmful = scores(*((name, 0.5) for name in HARMFUL), title=HARMFUL[0], notes=HARMFUL)
    tables = [table, aligned, harmful]
    document = "\\documentclass{article}\\usepackage{booktabs}\\begin{document}%s\\end{document}"
    text = document % "".join(map(to_latex, tables))
    (tmp_path / "t.tex").write_text(text, encoding="utf-8")
    command = ["pdflatex", "-halt-on-error", "-draftmode", "-no-shell-escape", "t.tex"]
    done_so = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
    assert done_so.returncode == 0, done_so.stdout[-900:].decode(errors="replace")
    assert r"\textbackslash{}u043a\textbackslash{}u043b" in text


@pytest.fixture
def aligned():
    columns = [
        ["a", "b", "c", "none"],
        ["0.784 ±0.204", "0.103 [0.000, 0.210]", "0.929", "— (1 of 1 failed)"],
        ["7 of 119", "118.7 ±0.6 of 119", "119 of 119", "—"],
        ["better", "inconclusive", "worse", "—"],
        ["< .001", ".047", "1", "—"],
    ]
    rows = [
        [Cell(text, text == "119 of 119") for text in row] for row in zip(*columns, strict=True)
    ]
    return Table("t", "", ["tracker", "overlap", "success", "the first is", "p"], 1, rows)


@pytest.mark.parametrize(
    ("text", "is_text"),
    [("-0.5", False), ("[-12.3, 4]", False), (".047", False), ("< .001", False), ("7 of 9", False),
     ("~3.1", False), ("1e-5", False), ("2026-11-23", True), ("294f9", True), ("—", False)],
)  # fmt: skip
def test_column_with_a_number_at_the_start_is_not_text(text, is_text):
    table = Table("t", "", ["a", "b"], 1, [[Cell("a"), Cell(text)]])
    assert text_columns(table) == [True, is_text]


def test_numbers_are_on_the_right_in_every_format(aligned):
    assert to_text(aligned).splitlines()[2:] == [
        "tracker               overlap            success   the first is       p",
        "-------  --------------------  ------------------  ------------  ------",
        "a                0.784 ±0.204           7 of 119   better        < .001",
        "b        0.103 [0.000, 0.210]  118.7 ±0.6 of 119   inconclusive    .047",
        "c                       0.929         119 of 119*  worse              1",
        "none        — (1 of 1 failed)                  —   —                  —",
    ]
    latex = to_latex(aligned)
    assert r"\begin{tabular}{lrrlr}" in latex
    assert r"a & 0.784 $\pm$0.204 & 7 of 119 & better" in latex
    assert r"\textbf{119 of 119}" in latex
    assert "| --- | ---: | ---: | --- | ---: |" in to_markdown(aligned)


def test_cells_with_statements_are_texts():
    rows = [[Cell("a"), Cell("0 of 2")], [Cell("b"), Cell("1 of 4; post hoc 2 of 4; fragile")]]
    assert text_columns(Table("t", "", ["claim", "holds in"], 1, rows)) == [True, True]
    assert text_columns(Table("t", "", ["claim", "holds in"], 1, rows[:1])) == [True, False]


def test_table_without_data_writes_the_texts_of_its_cells():
    cells = [[Cell("a"), Cell("1 ± 2", is_best=True)]]
    plain = Table("t", "", ["tracker", "score"], 1, cells)
    assert to_csv(plain) == "tracker,score\na,1 ± 2\n"
    assert json.loads(to_json(plain))["rows"] == [{"tracker": "a", "score": "1 ± 2"}]
    equal = Table("t", "", ["", "verdict", "verdict"], 1, [[*cells[0], Cell("x")]])
    assert to_csv(equal) == "1,2 verdict,3 verdict\na,1 ± 2,x\n"
    assert to_csv(Table("t", "", ["tracker"], 1, [])) == "\n"
