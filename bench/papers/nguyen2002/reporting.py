"""From stored runs and what was measured on the scenes to the paper's report."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from bench.claims.conclusion import Conclusion
from bench.claims.evaluation import NOT_RUN
from bench.papers import Asked, Effort, Report
from bench.papers.drawing import undrawn
from bench.papers.judging import conclusions, failure_remarks
from bench.papers.nguyen2002 import RECORDED, TIMED, TITLE, examined_tables
from bench.papers.nguyen2002.figures import NUMBERS, draw
from bench.papers.nguyen2002.measured import measured_table
from bench.papers.nguyen2002.measures import CLIPS, by_sets, failures_by_margin, set_table
from bench.papers.nguyen2002.published import table_rows, time_rows
from bench.papers.nguyen2002.scores import CELL, tidy_scores
from bench.papers.nguyen2002.tables import choices_table, clips_table, lights_table
from bench.papers.nguyen2002.timing import run_times, time_table
from bench.papers.recorded import read_published
from bench.papers.scores import without_failures
from bench.papers.tables import text_table
from bench.papers.timed import failed_passes
from reports.ledger import ledger_table
from reports.tables import MISSING, Table

__all__ = ["make_report", "verdicts_table"]

COMPANIONS = "the other features there, and the whole set that a clip belongs to"

READINGS: Mapping[str, Mapping[str, str]] = {
    "as written, revised boxes": {},
    "as written, online": {"trace": "online"},
    "arctan, revised": {"definition": "arctan"},
    "L = 67, revised": {"variant": "longest_occlusion=67"},
    "L = 67, online": {"variant": "longest_occlusion=67", "trace": "online"},
    "recommended (post hoc), revised": {"preset": "recommended"},
    "recommended (post hoc), online": {"preset": "recommended", "trace": "online"},
    "robust (post hoc), revised": {"preset": "robust"},
    "robust (post hoc), online": {"preset": "robust", "trace": "online"},
}


def make_report(results: Path, folder: Path, effort: Effort, asked: Asked) -> Report:
    """See `bench.papers.Paper.report`."""
    scored = [name for name in asked if name not in (TIMED, RECORDED.name)]
    pieces = [tidy_scores(results / name, asked[name]) for name in scored]
    scores = pd.concat(pieces, ignore_index=True)
    # Several experiments may have some runs; equal text means equal boxes.
    scores = scores.drop_duplicates(["text", "name", "trace"], ignore_index=True)
    judged = without_failures(scores, CELL)
    sets, judged_sets = set_table(scores), set_table(judged)
    examined = examined_tables(folder, effort)
    measured = {
        **examined,
        "ng-10": run_times(results / TIMED, asked[TIMED]),
    }
    tested = {**by_sets(measured), "sets": judged_sets}
    if "ng-9" in examined:
        tested["ng-9-failures"] = failures_by_margin(examined["ng-9"], judged)
    claims = conclusions("nguyen2002", judged, tested)
    for_scripts = [claim.for_json() for claim in claims]
    tables = [
        ledger_table(for_scripts, gated=False),
        verdicts_table(claims),
        clips_table(sets),
        lights_table(scores),
        measured_table(examined),
        time_table(measured["ng-10"], failed_passes(results / TIMED, asked[TIMED])),
    ]
    if effort.everything:
        tables.insert(4, choices_table(sets))
    if RECORDED.name in asked:
        published = {} if effort.published is None else read_published(effort.published)
        name = RECORDED.name
        tables.append(RECORDED.table(results / name, published, asked[name]))
    pictures = draw(results, folder, asked, measured, scores)
    runs = scores[scores["trace"] == "online"]
    return Report(
        title=TITLE,
        remarks=_remarks(sets, effort)
        + undrawn(pictures, NUMBERS)
        + failure_remarks(runs, runs, judged[judged["trace"] == "online"], CELL, COMPANIONS),
        tables=tables,
        rows=[*table_rows(judged_sets), *time_rows(measured["ng-10"])],
        claims=for_scripts,
        pictures=pictures,
    )


def verdicts_table(claims: Sequence[Conclusion]) -> Table:
    """Verdicts by reading."""
    data = []
    for one in claims:
        told = {words: _verdict_under(one, reading) for words, reading in READINGS.items()}
        data.append({"claim": one.claim.id, **told})
    return text_table(
        "verdicts",
        "Verdicts by reading: both traces, the definition of the invariants that the paper cites, "
        "L = 67 instead of 35, and presets that were chosen after seeing results (post hoc). A "
        "dash: not run so, or nothing that the choice could change; --all: run only with that",
        data,
        n_labels=1,
    )


def _verdict_under(one: Conclusion, reading: Mapping[str, str]) -> str:
    """A verdict in words, where what was run tells this reading from the headline."""
    if NOT_RUN in one.reason:
        return "--all"
    told_apart = {column for finding in one.findings for column in finding.reading}
    found = one.under(reading) if reading.keys() <= told_apart else None
    return found[0].replace("-", " ") if found else MISSING


def _remarks(sets: pd.DataFrame, effort: Effort) -> list[str]:
    by_sequence = sets.groupby("sequence")["scene"].nunique()
    remarks = [
        "Other videos: the paper's recording and its film are lost to us. Ours were designed from "
        "its words, frozen, and only then tracked; its numbers stand beside ours, no target.",
        f"{by_sequence.get(CLIPS, 0)} sets of 20 clips with 21 complete occlusions, and "
        f"{by_sequence.drop(CLIPS, errors='ignore').max():.0f} scenes of the recording: a set, or "
        "a scene, is the unit of every verdict. The tracker draws nothing: it runs once.",
        "The paper looks ahead for the end of an occlusion, so that the headline is what the "
        "tracker says in the end (revised). What it says at once (online) stands beside it: while "
        "it waits, its box goes on as it went.",
        "Success: an overlap of 0.5 or more in 90 % of the frames that show 90 % of the target, "
        "and in the last five of them. Detected: an occlusion that is declared, and after which "
        "the target is found again. The paper defines neither.",
        "As written are K = 10, L = 35, the search's range and steps, the covariance of the "
        "first match, and least eigenvalues of covariances (smaller ones are raised) by decision: "
        "the text does not say. L = 67, the next number of its list, stands beside it.",
        "The presets recommended and robust were chosen after seeing results: their verdicts are "
        "readings post hoc.",
        "False occlusions are not reported by the paper. After each the target is searched for "
        "and found again or not: revised boxes hardly show the wait for it, online boxes do.",
        "Said hidden: of the frames that show 90 % of the target, those in which the tracker says "
        "at once that it is hidden. Where they are most, as for RGB and the invariants as written "
        "in the recording, one occlusion is declared after another, and tracked (revised) means "
        "that the target is mostly found again 5, 7, 11, 19 or 35 frames after each beginning, "
        "with a straight line between, not that it is followed frame by frame.",
    ]
    return [f"MARKED: {effort.words}.", *remarks] if effort.words else remarks
