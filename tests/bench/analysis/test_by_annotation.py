"""Scores by annotated attribute: tables, radar plot and VOT's expected average overlap."""

import pandas as pd
import pytest

from tests.bench.commands.conftest import assert_tables_have_rows
from trackmark.bench.analysis.by_annotation import annotation_reports
from trackmark.bench.analysis.by_metrics import metric_tables
from trackmark.bench.store.runs import Runs

ATTRIBUTES = {"one": "OCC, SV", "two": "OCC", "three": "SV, FM"}


@pytest.fixture
def tagged(workspace, otb):
    """Write three sequences of 120 frames with OTB's `attrs.txt`."""
    for number, (name, tags) in enumerate(ATTRIBUTES.items()):
        folder = otb(workspace / "tagged" / name, 120)
        boxes = [f"{5 + (number + 1) * frame // 40},6,10,12\n" for frame in range(120)]
        (folder / "groundtruth_rect.txt").write_text("".join(boxes))
        (folder / "attrs.txt").write_text(tags)
    return "tagged"


@pytest.mark.slow
def test_report_has_table_and_radar_plot_of_annotations(trackmark, workspace, tagged):
    trackmark("run", "--trackers", "static,camshift", "--sequences", tagged, "--name", "tagged")
    trackmark("report", "results/tagged", "--by-attribute", "--output", "paper")
    assert_tables_have_rows(workspace / "paper")
    table = pd.read_csv(workspace / "paper" / "annotated-native.csv")
    rows = pd.read_csv(workspace / "paper" / "sequences.csv")
    rows = rows[rows["measure"] == "mean_overlap"].set_index(["tracker", "sequence"])
    for row in table.to_dict("records"):
        for attribute in ("OCC", "SV", "FM"):
            members = [name for name, tags in ATTRIBUTES.items() if attribute in tags]
            expected = [rows.loc[(row["tracker"], name), "mean"] for name in members]
            assert row[attribute] == pytest.approx(sum(expected) / len(expected))
    assert (workspace / "paper" / "annotated-native.png").stat().st_size > 10_000


@pytest.mark.slow
def test_scores_without_finite_value_have_neither_rows_nor_plot(trackmark, workspace, otb):
    folder = otb(workspace / "short" / "one", 12)
    (folder / "attrs.txt").write_text("OCC, SV, FM")
    trackmark("run", "--trackers", "static", "--sequences", "short", "--name", "short")
    arguments = "--by-attribute", "--metrics", "vot", "--output", "paper"
    text = trackmark("report", "results/short", *arguments).stdout
    assert "The table is empty: no tracker has a finite EAO on these sequences." in text
    assert not list((workspace / "paper").glob("annotated-*.png"))


@pytest.mark.slow
def test_expected_overlap_by_annotation_is_that_of_a_subset(trackmark, workspace, tagged):
    run = ("run", "--trackers", "static", "--protocol", "supervised", "--name")
    trackmark(*run, "whole", "--sequences", tagged)
    trackmark(*run, "part", "--sequences", "tagged/one,tagged/two")
    (report,) = annotation_reports(Runs.open(workspace / "results" / "whole"), ["native"])
    assert report.headings == ["FM (1)", "OCC (2)", "SV (2)"]
    (part,) = metric_tables(Runs.open(workspace / "results" / "part"), ["native"]).with_curves
    scores = part.table.records.set_index(["sequence", "measure"])["mean"]
    assert report.scores["static"][1] == pytest.approx(scores["all sequences", "eao"])
