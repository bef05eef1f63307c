"""Every paper's report of made-up runs is, to the letter, the one that was kept.

Where a change is meant, `TRACKMARK_GOLDEN=write pytest tests/bench/papers/test_golden.py` writes
the reports anew; what differs is read before it is committed.
"""

import os
from pathlib import Path

import pandas as pd
import pytest

from bench.experiments.contestant import contestant
from bench.papers import Effort, load_paper
from bench.papers import report as reporting
from bench.papers.moreno2005 import measures as moreno2005
from bench.papers.nguyen2002 import measures as nguyen2002
from bench.papers.nummiaro2003 import measures as nummiaro2003

FOLDER = Path(__file__).parent / "golden"

MEASURES = {
    "moreno2005": ("lost", "lost_by_jump", "mean_region_similarity", "mean_contour_accuracy"),
    "multipart": ("part_distance", "near_occlusion"),
    "nguyen2002": (
        *("on_target", "success", "said_hidden", "jitter", "outliers", "never_lost"),
        *("occlusions", "declared", "detected", "detected_share", "false_occlusions"),
        *("lost_at_switch", "lost_at_off", "lost_at_on", "lost_elsewhere"),
        *("kept_after_off", "clear_after_off"),
    ),
    "nummiaro2003": tuple({*nummiaro2003.NAMES} - {"frames", "first_loss"}),
    "wang2010": (
        *("success", "stayed_lost", "deviates_12_to_15", "back_at_16", "still_wrong_at_16"),
        *("holds_10_and_38", "lost_at_58_and_100", "on_the_face_at_58"),
        "lost_at_36_and_44_and_51",
    ),
}
"""What a paper's `of_run` adds."""

TABLES = {
    "moreno2005": {
        "times": {
            "text": ["moreno2005", "contour-smooth-color"],
            "tracker": ["moreno2005", "contour-smooth-color"],
            "seconds": [3e-3, 2e-3],
            "decoded": [5e-3, 4e-3],
            **{key: [1.0, 0.7] for key in ("ratio", "low", "high", "reference", "load")},
        },
    },
    "multipart": {
        "identity": {"identical": [True, True]},
        "layout": {"single": [0.0], "multi": [0.9]},
        "times": {
            "kernel": ["one pass", "two calls"] * 10,
            "single": [1.0 + i / 20 for i in range(20)],
            "multi": [1.3 + i / 20 for i in range(20)],
            "ratio": [(1.3 + i / 20) / (1.0 + i / 20) for i in range(20)],
            "reference": [1e-3] * 20,
        },
        "updates": {
            "sequence": ["multipart/5"] * 2,
            "tracker": ["multipart"] * 2,
            "text": [
                contestant(f"multipart:representation={name}:init=full").label
                for name in ("single", "multi")
            ],
            "seconds": [3e-3, 4e-3],
            "decoded": [5e-3, 6e-3],
            **{key: [1.0, 1.3] for key in ("ratio", "low", "high", "reference", "load")},
        },
        "switch": {
            "sequence": [f"multipart/{number}" for number in range(1, 9)] * 3,
            "scene": [0] * 24,
            "init": ["full"] * 8 + ["tight"] * 8 + ["boxes"] * 8,
            "kept_scene": [True] * 24,
            "distance": [0.3 + number / 80 for number in range(24)],
            "multi_share": [number / 24 for number in range(24)],
        },
    },
    "nummiaro2003": {
        "frame_times": {
            "sequence": ["nummiaro2003/person"] * 80 + ["nummiaro2003/car"] * 80,
            "frame": [*range(80)] * 2,
            "area": [float(number) for number in range(160)],
            "seconds": [float(number % 140) for number in range(160)],
        },
        "background": {
            "sequence": [f"nummiaro2003/{name}" for name in ("person", "head")] * 8,
            "scene": [number // 2 for number in range(16)],
            "positions": [100] * 16,
            "below_threshold": [0.9 + number / 200 for number in range(16)],
        },
    },
}
"""What a paper's own checks read."""


def as_counted(runs):
    """Yes or no, and counts of what there is."""
    declared = (runs["declared"] > 0.3).astype(float)
    known = {"occlusions": 1.0, "declared": declared, "clear_after_off": 20.0}
    known["detected"] = known["detected_share"] = declared * (runs["detected"] > 0.3)
    yes_or_no = ("success", "never_lost", "lost_at_switch", "lost_at_off", "lost_at_on")
    known |= {name: (runs[name] > 0.4).astype(float) for name in (*yes_or_no, "lost_elsewhere")}
    return runs.assign(**known)


def with_frames(runs):
    """Frames of either kind, and updates in some of them."""
    updates = {name: (100 * runs[name]).round() for name in ("good_updates", "other_updates")}
    return runs.assign(good_frames=100.0, other_frames=100.0, waiting_frames=50.0, **updates)


COUNTED = {"nguyen2002": as_counted, "nummiaro2003": with_frames}
"""What makes counts of a paper's made-up numbers."""

OF_RUNS = {
    "moreno2005": lambda runs: {
        "mo-9": moreno2005.patches(runs),
        "mo-23": moreno2005.deviations(runs),
        "one-dimensional-factorisation": pd.DataFrame(
            {"dependence": moreno2005.DEPENDENCES, "distance": [0.3, 1e-16]}
        ),
    },
    "nguyen2002": lambda runs: {"sets": nguyen2002.set_table(runs)},
}
"""Tables that a paper makes of its runs."""

REPETITIONS = {"nguyen2002": 1}
"""Most repetitions, two for others: a set of clips has each of them once."""

TIMED = ("multipart", "wang2010")
"""Papers whose published numbers stand beside times that are measured in this call."""


@pytest.mark.parametrize("name", sorted(MEASURES))
def test_a_report_of_made_up_runs_is_the_one_that_was_kept(name, made_up, tmp_path, monkeypatch):
    paper = load_paper(name)
    runs = made_up.runs(paper, MEASURES[name], REPETITIONS.get(name, 2))
    copies = reporting.part_of(name, "scores")
    runs = COUNTED[name](runs) if name in COUNTED else runs
    runs = copies(runs) if copies else runs
    tables = made_up.tables(paper)
    tables |= {key: pd.DataFrame(table) for key, table in TABLES.get(name, {}).items()}
    tables |= OF_RUNS.get(name, lambda _: {})(runs)
    shown = {
        key: entry
        for key, entry in paper.description.table.items()
        if not entry.hook.startswith("timing.") and entry.hook != "tables.scene_table"
    }
    entries = {"table": shown, "figure": {}, "scenes": None}
    paper.description = paper.description.model_copy(update=entries)
    monkeypatch.setattr(paper, "_scores", lambda *_: runs)
    monkeypatch.setattr(paper, "_on_scenes", lambda *_: tables)
    monkeypatch.setattr(reporting, "all_grounds", lambda *_: {})  # no scene was rendered
    left_out = {"tables", "kept"} | ({"published"} if name in TIMED else set())
    part_of = reporting.part_of
    monkeypatch.setattr(
        reporting,
        "part_of",
        lambda paper, name, module="measures": (
            {} if name in left_out else part_of(paper, name, module)
        ),
    )
    monkeypatch.setattr(paper, "_disturbances", lambda _: [])
    effort = Effort(everything=True)
    asked = {one.name: () for one in paper.experiments(effort)}
    report = paper.report(tmp_path, tmp_path, effort, asked)
    text, file = efforts_of(paper) + made_up.told(report), FOLDER / f"{name}.txt"
    if os.environ.get("TRACKMARK_GOLDEN") == "write":
        file.write_text(text)
    assert text == file.read_text()


def efforts_of(paper):
    """What each effort runs: sequences, trackers and repetitions by experiment."""
    efforts = {"quick": Effort(quick=True), "default": Effort(), "all": Effort(everything=True)}
    return "".join(
        f"{words}: {one.name}, {len(one.sequences)} x {len(one.trackers)} x {one.repetitions}\n"
        for words, effort in efforts.items()
        for one in paper.experiments(effort)
    )
