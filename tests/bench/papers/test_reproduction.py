"""A reproduction of a tiny paper: evidence, verdicts, tables, page and terminal output."""

from dataclasses import replace

from trackmark.bench.papers.evidence import evidence
from trackmark.bench.papers.markdown_page import page, write_page
from trackmark.bench.papers.reproduction import report_data
from trackmark.bench.papers.terminal_report import screen


def test_verdicts_rest_on_scenes_that_meet_the_criteria(report):
    order, share, time = report.verdicts
    assert set(order.evidence["recommended"].first["scene"]) == {
        f"plain/target:length=20:scene={scene}" for scene in (200, *range(202, 213))
    }
    assert order.verdicts["recommended"].effect.endswith("px, 12 scenes")
    assert share.verdicts["as-written"] == share.verdicts["recommended"]
    assert share.claim.note in report_data(report, 1.0)["claims"][1]["note"]
    assert time.verdicts["as-written"].verdict == "holds"
    assert time.verdicts["as-written"].effect.startswith("2.0")


def test_main_table_has_the_papers_numbers_beside_both_settings(report):
    main, times = report.main
    assert main.heads == ["sequence", "tracker", "paper", "as written", "recommended"]
    first, second = ([cell.text for cell in row] for row in main.rows)
    assert first[2] == "20 of 20"
    assert first[3].endswith(" px")
    assert " %, " in first[3]
    assert second[3].count(" / ") == 1
    assert times.caption == "Times."


def test_sensitivity_table_changes_one_choice(report):
    (row,) = report.sensitivity.rows
    assert [cell.text for cell in row[:2]] == ["16 bins", "recommended"]
    assert row[2].text.endswith(" px")
    assert row[3].text in {"0.0", "1.0", "2.0"}, "a share that is added up over members is a count"


def test_page_begins_with_the_result_and_ends_with_history(report, tmp_path):
    write_page(tmp_path / "tiny.md", report)
    text = (tmp_path / "tiny.md").read_text("utf-8")
    assert text == page(report, tmp_path)
    (file, *_) = (drawing.path for drawing in report.figures)
    assert f"[{file.name}]({file.name}): " in page(report, file.parent)
    assert f"`{file.name}`: " in text  # the figures lie in another folder
    places = [
        "# A tiny paper",
        "**Result.** CamShift follows the target.",
        "## 1 The paper's numbers and ours",
        "20 of 20",
        "## 2 Figures",
        "## 3 Verdicts",
        "TI-1",
        "## 4 What differs and why",
        "- The window.",
        "## 5 The scenes",
        "a moving target",
        "Skipped scenes of target: 201.",
        "## 6 Settings",
        "## 7 Sensitivity (no verdicts)",
        "16 bins",
        "## 8 How to run it",
        "trackmark reproduce tiny --all",
        "## 9 History",
        "- One scene was replaced.",
    ]
    positions = [text.index(part) for part in places]
    assert positions == sorted(positions)


def test_terminal_shows_the_main_table_before_the_verdicts(report, tmp_path):
    text = screen(report, tmp_path)
    assert text.index("20 of 20") < text.index("TI-1")
    assert "as-written: " in text
    assert f"{tmp_path / 'report.html'}" in text


def test_quick_report_has_no_verdicts(tiny, tmp_path):
    quick = tiny.report(quick=True)
    text = screen(quick, tmp_path)
    assert quick.verdicts == []
    assert len(quick.main) == 1  # nothing is timed
    assert "2 scenes per sequence" in text
    assert "TI-1" not in text
    assert "not run" not in text
    assert "## 3 Verdicts" not in page(quick, tmp_path)


def test_failed_run_counts_as_lost_and_is_named(tiny, report, monkeypatch):
    runs, scene = report.context.runs, report.verdicts[1].evidence["recommended"].first["scene"][0]
    judged_runs, (judged,) = runs.judged_runs, runs.judged_runs("static", scene)
    failed = replace(judged, run=replace(judged.run, failure="frame 3: ValueError: no"))
    monkeypatch.setattr(
        runs,
        "judged_runs",
        lambda *run: [failed] if run == ("static", scene) else judged_runs(*run),
    )
    values = evidence(tiny.paper.claims["TI-2"], "recommended", report.context)
    assert values.first["value"].iloc[0] == 0
    assert values.failed.startswith("1 of 12 runs failed and count as lost. First: plain/")
    assert values.failed.endswith("frame 3: ValueError: no")
