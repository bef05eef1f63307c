"""Every paper's report of made-up runs is, to the letter, the one that was kept.

Where a change is meant, `TRACKMARK_GOLDEN=write pytest tests/bench/papers/test_golden.py` writes
the reports anew; what differs is read before it is committed.
"""

import os
from pathlib import Path

import pandas as pd
import pytest

from bench.papers import Effort, load_paper
from bench.papers import report as reporting
from bench.papers.nummiaro2003.courses import NAMES

FOLDER = Path(__file__).parent / "golden"

MEASURES = {
    "multipart": ("part_distance", "near_occlusion"),
    "nummiaro2003": tuple({*NAMES} - {"frames", "first_loss"}),
    "wang2010": (
        *("success", "stayed_lost", "deviates_12_to_15", "back_at_16", "still_wrong_at_16"),
        *("holds_10_and_38", "lost_at_58_and_100", "on_the_face_at_58"),
        "lost_at_36_and_44_and_51",
    ),
}
"""What a paper's `of_run` adds."""

TABLES = {
    "multipart": {
        "identity": {"identical": [True, True]},
        "layout": {"single": [0.0], "multi": [0.9]},
        "times": {
            "kernel": ["one pass", "two calls"] * 10,
            "single": [1.0 + i / 20 for i in range(20)],
            "multi": [1.3 + i / 20 for i in range(20)],
        },
        "switch": {
            "sequence": [f"multipart/{number}" for number in range(1, 9)] * 3,
            "init": ["full"] * 8 + ["tight"] * 8 + ["boxes"] * 8,
            "kept_scene": [True] * 24,
            "distance": [0.3 + number / 80 for number in range(24)],
            "multi_share": [number / 24 for number in range(24)],
        },
    },
    "nummiaro2003": {
        "frame_times": {"area": [1.0, 2.0, 3.0, 4.0], "seconds": [1.0, 3.0, 2.0, 4.0]},
        "background": {
            "sequence": [f"nummiaro2003/{name}" for name in ("person", "head")] * 8,
            "scene": [number // 2 for number in range(16)],
            "positions": [100] * 16,
            "below_threshold": [0.9 + number / 200 for number in range(16)],
        },
    },
}
"""What a paper's own checks read."""


@pytest.mark.parametrize("name", sorted(MEASURES))
def test_a_report_of_made_up_runs_is_the_one_that_was_kept(name, made_up, tmp_path, monkeypatch):
    paper = load_paper(name)
    runs = made_up.runs(paper, MEASURES[name])
    copies = reporting.part_of(name, "scores")
    tables = made_up.tables(paper)
    tables |= {key: pd.DataFrame(table) for key, table in TABLES.get(name, {}).items()}
    shown = {
        key: entry
        for key, entry in paper.description.table.items()
        if not entry.hook.startswith("timing.") and entry.hook != "tables.scene_table"
    }
    entries = {"table": shown, "figure": {}, "scenes": None}
    paper.description = paper.description.model_copy(update=entries)
    monkeypatch.setattr(paper, "_scores", lambda *_: copies(runs) if copies else runs)
    monkeypatch.setattr(paper, "_on_scenes", lambda *_: tables)
    monkeypatch.setattr(reporting, "part_of", no_tables(reporting.part_of))
    report = paper.report(tmp_path, tmp_path, Effort(everything=True), {})
    text, file = made_up.told(report), FOLDER / f"{name}.txt"
    if os.environ.get("TRACKMARK_GOLDEN") == "write":
        file.write_text(text)
    assert text == file.read_text()


def no_tables(part_of):
    """Without what is measured in this call, and a gate that keeps the scenes it knows."""
    left_out = {"tables", "kept", "published"}
    return lambda paper, name, module="measures": (
        {} if name in left_out else part_of(paper, name, module)
    )
