"""The table model and its renderers against values computed by hand."""

import io
import json
import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest

from trackmark.reports.renderers import to_csv, to_json, to_latex, to_markdown, to_text
from trackmark.reports.tables import (
    Cell,
    ScoreMeasure,
    Table,
    Uncertainty,
    complete,
    sequence_table,
    summary_table,
    text_columns,
)

OVERLAP = ScoreMeasure("overlap", "overlap", direction="higher", decimals=3)
ERROR = ScoreMeasure("error", "error", "px", "lower", 1)
COUNT = ScoreMeasure("count", "success", "frames", "higher", 1, out_of="total")


def runs(*rows):
    columns = ["tracker", "sequence", "repetition", "status", "overlap", "error"]
    table = pd.DataFrame(rows, columns=columns)
    table["failure"] = np.where(table["status"] == "failed", "frame 3: ValueError: why\ntrace", "")
    table["count"] = table["overlap"] * 100
    table["total"] = 100.0
    return table


def done(tracker, sequence, repetition, overlap, error=1.0):
    return (tracker, sequence, repetition, "finished", overlap, error)


def texts(table):
    return [[cell.text for cell in row] for row in table.rows]


def mark_best(values, measure):
    """Mark the best mean; no intervals."""
    means = values.mean(axis=1) * (1 if measure.direction == "higher" else -1)
    return Uncertainty([None] * len(means), [len(means) > 1 and m == means.max() for m in means])


def summary(rows, measures=(OVERLAP,), title="T"):
    return summary_table(runs(*rows), measures, title, "native", mark_best)


def sequences(rows, measures=(OVERLAP,)):
    return sequence_table(runs(*rows), measures, "T", "native")


def test_summary_weights_sequences_equally():
    table = summary([done("a", "s", 0, 0.2), done("a", "s", 1, 0.4), done("a", "t", 0, 0.9)])
    assert texts(table) == [["a", "0.600"]]  # (0.3 + 0.9) / 2, not (0.2 + 0.4 + 0.9) / 3


def test_spread_is_standard_deviation_over_repetitions():
    rows = [done("a", "s", 0, 0.2), done("a", "s", 1, 0.4)]
    more = [done("a", "t", 0, 0.6), done("a", "t", 1, 0.5)]
    spread = np.std([0.4, 0.45], ddof=1)
    assert texts(summary(rows + more)) == [["a", f"0.425 ±{spread:.3f}"]]
    assert texts(sequences(rows)) == [["s", "a", f"0.300 ±{np.std([0.2, 0.4], ddof=1):.3f}"]]


@pytest.mark.parametrize("status", ["missing", "stale"])
def test_missing_and_stale_runs_make_mean_missing(status):
    table = sequences([done("a", "s", 0, 0.2), ("a", "s", 1, status, 0.9, 0.0)])
    assert texts(table) == [["s", "a", f"— (1 of 2 {status})"]]
    assert table.notes[0].startswith(f"{status}: a, 1 ")


def test_failed_runs_without_score_make_mean_missing():
    failed = ("a", "s", 1, "failed", np.nan, np.nan)
    table = summary([done("a", "s", 0, 0.2), failed, done("b", "s", 0, 0.5)])
    assert texts(table) == [["a", "— (1 of 2 failed)"], ["b", "0.500"]]
    assert table.notes == ["a: 1 of 2 runs failed: sequence s, ValueError: why"]


def test_failed_runs_with_score_count():
    failed = ("a", "s", 1, "failed", 0.0, 9.0)
    table = sequences([done("a", "s", 0, 0.2), failed])
    assert table.rows[0][2].text.startswith("0.100")
    assert table.notes == [
        "a: 1 of 2 runs failed (counted as the worst score): sequence s, ValueError: why"
    ]


def test_summary_averages_over_units_and_shows_their_intervals():
    rows = [
        done("a", name, 0, overlap) for name, overlap in zip("stu", (0.2, 0.4, 0.9), strict=True)
    ]
    frame = runs(*rows).assign(unit=["x", "x", "y"])
    seen = []

    def interval(values, measure):
        seen.append(values.tolist())
        return Uncertainty([(0.25, 0.95)], [False])

    table = summary_table(frame, (OVERLAP,), "T", "native", interval, "Meaning.")
    assert seen == [[[pytest.approx(0.3), 0.9]]]
    assert texts(table) == [["a", "0.600 [0.250, 0.950]"]]
    assert table.data[["low", "high"]].to_numpy().tolist() == [[0.25, 0.95]]
    assert table.caption.endswith("in 2 units, each counting once; metrics preset native. Meaning.")


def test_tracker_without_sequence_has_no_mean_and_no_row():
    rows = [done("a", "s", 0, 0.2), done("a", "t", 0, 0.2), done("b", "s", 0, 0.9)]
    table = summary(rows)
    assert texts(table) == [["a", "0.200"], ["b", "— (1 of 2 not run)"]]
    assert table.notes == ["not run: b, 1 of the sequences"]
    assert texts(sequences(rows[1:])) == [["t", "a", "0.200"], ["s", "b", "0.900"]]


def test_malformed_boxes_are_counted_by_tracker():
    frame = runs(done("a", "s", 0, 0.5), done("a", "s", 1, 0.5), done("b", "s", 0, 0.5))
    frame["malformed"] = [2.0, 1.0, 0.0]
    (note,) = summary_table(frame, (OVERLAP,), "T", "native").notes
    assert note == "malformed: a, 3 boxes not finite with a positive size: misses"


def test_missing_score_makes_mean_missing():
    assert texts(summary([done("a", "s", 0, np.nan), done("a", "s", 1, 0.5)])) == [["a", "—"]]


def test_complete_adds_only_missing_pairs():
    full = runs(done("a", "s", 0, 0.1), done("b", "s", 0, 0.1))
    assert complete(full) is full
    added = complete(runs(done("a", "s", 0, 0.1), done("b", "t", 0, 0.1)))
    statuses = added.groupby(["tracker", "sequence"])["status"].first()
    assert statuses.to_dict() == {
        (tracker, sequence): "finished" if tracker + sequence in ("as", "bt") else "not run"
        for tracker in "ab"
        for sequence in "st"
    }


def test_sequence_table_has_no_marks():
    table = sequences([done("a", "s", 0, 0.9), done("b", "s", 0, 0.8)])
    assert not any(cell.best for row in table.rows for cell in row)


def test_cells_show_totals_of_counts_and_scaled_values():
    assert texts(sequences([done("a", "s", 0, 0.5)], [COUNT])) == [["s", "a", "50 of 100"]]
    percent = ScoreMeasure("overlap", "o", "%", "higher", 1, scale=100)
    table = summary([done("a", "s", 0, 0.25)], [percent])
    assert texts(table) == [["a", "25.0"]]
    assert table.data["mean"].tolist() == [0.25]


@pytest.fixture
def table():
    rows = [
        done("static", "s", 0, 0.25, 12.0),
        done("camshift:hue_bins=16", "s", 0, 0.75, 3.25),
        ("odd|_*&%$#{}~^\\<", "s", 0, "failed", np.nan, np.nan),
    ]
    return summary(rows, [OVERLAP, ERROR], "A & B_c")


def test_text_is_aligned_and_has_marks(table):
    assert to_text(table).splitlines()[2:] == [
        "tracker                         overlap          error [px]",
        "--------------------  ------------------  ------------------",
        "static                            0.250                12.0",
        "camshift:hue_bins=16              0.750*                3.2*",
        "odd|_*&%$#{}~^\\<      — (1 of 1 failed)   — (1 of 1 failed)",
        "odd|_*&%$#{}~^\\<: 1 of 1 runs failed (left out): sequence s, ValueError: why",
    ]


def test_text_aligns_wide_characters():
    table = summary([done("追跡", "s", 0, 0.5), done("abcd", "s", 0, 0.25)])
    lines = to_text(table).splitlines()[4:]
    assert lines == ["追跡       0.500*", "abcd       0.250"]


def test_markdown_has_as_many_cells_in_every_row(table):
    lines = [line for line in to_markdown(table).splitlines() if line.startswith("|")]
    unescaped = [line.replace("\\\\", "").replace("\\|", "") for line in lines]
    assert {line.count("|") for line in unescaped} == {4}
    assert "**0.750**" in lines[3]


def test_csv_has_unrounded_values_preset_and_totals():
    table = sequences([done("a,b", "s", 0, 0.1 + 0.2)], [OVERLAP, COUNT])
    back = pd.read_csv(io.StringIO(to_csv(table)))
    assert back["mean"].tolist() == [0.1 + 0.2, (0.1 + 0.2) * 100]
    assert back["tracker"].tolist() == ["a,b"] * 2
    assert back["preset"].tolist() == ["native"] * 2
    np.testing.assert_array_equal(back["out_of"], [np.nan, 100])


NAMES = ["=1+1", "@SUM(A1)", "-2 px", "+x", "'=1", "''-x", "-3", "'quoted'", "a-b", "-1e5", "—"]
NAMES += ["＝1+1", "-inf", "-1_0", "\t=1"]


def test_csv_headings_are_not_formulas():
    table = Table("t", "", ["sequence", "=1+1"], 1, [], data=pd.DataFrame({"=1+1": [-0.5]}))
    assert to_csv(table).splitlines() == ["'=1+1", "-0.5"]


@pytest.mark.parametrize("name", NAMES)
def test_csv_protects_formulas_as_documented(name):
    table = summary([done(name, "s", 0, -0.5)])
    text = to_csv(table)
    row = text.splitlines()[1]
    assert not row.lstrip('"').startswith(("=", "@", "+", "＝", "\t"))
    assert ",-0.5," in row
    back = pd.read_csv(io.StringIO(text), dtype={"tracker": str})
    (tracker,) = back["tracker"].str.replace(r"^'(?='*[=+@＝＋＠－-])", "", regex=True)
    assert tracker == name.replace("\t", r"\u0009")
    assert back["mean"].tolist() == [-0.5]


@pytest.mark.parametrize("render", [to_csv, to_latex, to_markdown, to_text])
def test_name_stays_in_its_line_and_cell(render):
    plain, odd = (
        render(summary([done(name, "s", 0, 0.5)], title=f"T {name}"))
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
    assert f"| {escaped} |" in to_markdown(summary([done(name, "s", 0, 0.5)]))


@pytest.mark.parametrize("name", ["[x]", "*x"])
def test_latex_protects_names_from_options(name):
    rows = to_latex(summary([done(name, "s", 0, 0.5)])).splitlines()
    assert f"{{}}{name} & 0.500 \\\\" in rows


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
    rows = [done(name, "s", 0, 0.5) for name in HARMFUL]
    rows += [("x", name, 0, "failed", np.nan, np.nan) for name in HARMFUL]
    tables = [table, aligned, summary(rows, title=HARMFUL[0]), sequences(rows)]
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
    cells = [[Cell("a"), Cell("1 ± 2", best=True)]]
    plain = Table("t", "", ["tracker", "score"], 1, cells)
    assert to_csv(plain) == "tracker,score\na,1 ± 2\n"
    assert json.loads(to_json(plain))["rows"] == [{"tracker": "a", "score": "1 ± 2"}]
    equal = Table("t", "", ["", "verdict", "verdict"], 1, [[*cells[0], Cell("x")]])
    assert to_csv(equal) == "1,2 verdict,3 verdict\na,1 ± 2,x\n"
    assert to_csv(Table("t", "", ["tracker"], 1, [])) == "\n"
