"""The page of a reproduction, of a report that was made up: no tracker runs."""

import io

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from bench.claims.judging import NOT_RUN
from bench.claims.readings import Readings
from bench.papers import NO_EVIDENCE, Effort, Report
from bench.papers.html_page import write_html_page
from reports.tables import Cell, Table
from tests import browser

HOSTILE = "<script>alert('x')</script> \"q\" & 跟踪"


def finding(reading, verdict, **told):
    told = {"metric": "first_loss", "light": "both", "scenes": "kept", "group": ""} | told
    numbers = {"statistic": 1.0, "interval": [0.5, 1.5], "unit": "px", "cells": 8}
    return {
        "reading": reading, "post_hoc": reading.startswith("σ"), "verdict": verdict,
        "effect": "1.0 [0.5, 1.5] px, 8 scenes", "counted": "scene", "reason": "",
        **numbers, **told,
    }  # fmt: skip


def claim(name, verdict, **evidence):
    known = {
        "reason": "It lies above zero.", "quote": f"It is tracked {HOSTILE}.", "kind": "order",
        "asserted": False, "ours": False, "falsifier": "It is lost.", "fragile": False,
        "published": [{"label": "sequence 1", "value": 788, "unit": "frames"}],
        "experiment": ["p-table-1"], "all_drawn_scenes": verdict, "post_hoc": "0 of 1",
        "findings": [finding("as written", verdict), finding("σ = 0.2", "does-not-hold")],
    }  # fmt: skip
    return {
        "id": name, "source": "Section 3", "text": "The target is tracked.", "short": "",
        "verdict": verdict, "effect": "1.0 [0.5, 1.5] px, 8 scenes", "statistic": 1.0,
        "interval": [0.5, 1.5], "unit": "px", "cells": 8, "counted": "scene",
        "readings": "1 of 1", "evidence": known | evidence,
    }  # fmt: skip


READINGS = Readings.model_validate(
    {"axes": {"text": {"as written": {"sigma": 1}, "σ = 0.2": {"sigma": 0.2, "post_hoc": True}}}}
)


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    picture = tmp_path_factory.mktemp("drawn") / "figure-3.png"
    stream = io.BytesIO()
    Image.fromarray(np.full((20, 30, 3), 200, np.uint8)).save(stream, "PNG")
    picture.write_bytes(stream.getvalue())
    rows = [[Cell(HOSTILE), Cell("17.7"), Cell("16")], [Cell("hue"), Cell("9"), Cell("—")]]
    table = Table("table-1", "Table 1", ["features", "ours", "paper"], 1, rows, pd.DataFrame())
    claims = [
        claim("P-1", "holds"),
        claim("P-2", "undecided", reason=f"{NOT_RUN}; leave out --quick.", findings=[])
        | {"effect": "", "statistic": None},
        claim("P-3", "does-not-hold"),
    ]
    title = f"{NO_EVIDENCE}: A paper"
    remarks = ["Other videos."]
    return Report(title, remarks, [table], [], claims, pictures=[picture], main=[table])


@pytest.fixture(scope="module")
def page(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    return write_html_page(path, report, READINGS, "wang2010", Effort(quick=True))[0]


def test_a_page_has_every_claim_table_and_figure_and_says_what_is_no_evidence(page):
    text = page.read_text()
    assert f"<h1>{NO_EVIDENCE}: A paper</h1>" in text
    assert "3 claims: 1 holds, 1 not run, 1 does-not-hold" in text
    assert "<td>17.7</td>" in text
    assert 'src="data:image/png;base64,' in text
    assert 'data-mark="not run"' in text
    assert "leave out --quick" in text
    assert "σ = 0.2 (post hoc)" in text
    assert "sequence 1: 788 frames" in text
    assert "trackmark reproduce wang2010 --quick" in text
    assert "<script>alert" not in text


@browser.needs_browser
def test_a_row_of_the_claims_opens_the_claim(page, tmp_path):
    shown = browser.Browser(tmp_path)
    try:
        shown.size(400, 800, mobile=True)
        shown.open(page.as_uri())
        shown.click("#claims tbody tr:nth-child(3) a")
        shown.wait("byId('claim-P-3').open")
        assert not shown.run("byId('claim-P-1').open")
        assert shown.run("document.documentElement.scrollWidth") <= 400
        assert shown.console == []
    finally:
        shown.close()
