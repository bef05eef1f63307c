"""Figures that are written next to the page of a report."""

import pytest

from trackmark.bench.analysis.by_metrics import metric_tables
from trackmark.bench.pages.report import ReportPage
from trackmark.bench.pages.report_figures import write_figures
from trackmark.bench.store.runs import Runs


@pytest.mark.slow
def test_figures_of_runs_are_written_next_to_the_page(results, tmp_path):
    report, messages = metric_tables(Runs.open(results), ["native", "otb"]), []
    page = ReportPage(Runs.open(results), report.tables)
    write_figures(page, tmp_path, "Trial", ".svg", messages.append, report.with_curves)
    names = {path.stem for path in tmp_path.glob("*.svg")}
    curves = {"success", "precision", "survival", "speed-accuracy"}
    assert names == curves | {"metrics-otb-success", "metrics-otb-precision"}
    assert len([*tmp_path.glob("strip-*.png")]) == 6
    assert messages == []
    assert "online boxes" in (tmp_path / "success.svg").read_text()
