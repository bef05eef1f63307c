"""Online and revised boxes: scores, captions and pictures of both."""

import shutil

import cv2
import numpy as np
import pandas as pd
import pytest

import trackmark as tm
from trackmark import datasets
from trackmark.bench.analysis import film_strips
from trackmark.bench.analysis.film_strips import write_strips
from trackmark.bench.analysis.run_tables import tables, with_revised_scores
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.evaluation.scoring import REVISED, score_both
from trackmark.bench.store.runs import Runs
from trackmark.reports.overlay import TRUTH, film_strip
from trackmark.reports.palette import colour

SECOND_THOUGHTS = '''
"""Returns a resting box, and at the end revised boxes that move to the right."""
from trackmark.trackers.base.interface import Estimate, TrackerPlugin


class SecondThoughts(TrackerPlugin):
    """Revises boxes."""

    def init(self, image, box, mask=None):
        self.box, self.frame = box, 0

    def update(self, image):
        self.frame += 1
        return Estimate(self.box)

    def finish(self):
        return {frame: self.box + [0.5 * frame, 0, 0, 0] for frame in range(1, self.frame + 1)}
'''


@pytest.fixture(scope="module")
def stored(tmp_path_factory, run_trial):
    """Provide an experiment with a tracker that revises boxes and one that does not."""
    folder = tmp_path_factory.mktemp("trajectories")
    file = folder / "second_thoughts.py"
    file.write_text(SECOND_THOUGHTS)
    sequences = [f"plain/target:length=15:scene={n}" for n in (0, 1)]
    return run_trial(folder, ("static", f"{file}:SecondThoughts"), sequences)


def overlaps(table):
    """Return the mean overlap by tracker in a summary."""
    place = table.headings.index("mean overlap")
    return {row[0].text: row[place].text for row in table.rows}


def test_revised_scores_are_computed_from_revised_boxes(stored, make_sequence):
    sequence = make_sequence(n=6)
    run = evaluate_run("static", sequence)
    assert not any(name.startswith(REVISED) for name in score_both(run, sequence))
    shifted = np.array(sequence.boxes)
    revised = tm.Run(**{**vars(run), "revised": shifted})
    assert score_both(revised, sequence)[f"{REVISED}mean_overlap"] == 1.0
    assert score_both(revised, sequence)["mean_overlap"] < 1.0
    np.testing.assert_array_equal(run.boxes_in("revised"), run.boxes)
    np.testing.assert_array_equal(revised.boxes_in("revised"), shifted)


def test_runs_without_revision_keep_their_scores(stored):
    runs = Runs.open(stored).table
    revised = with_revised_scores(runs)
    still = runs["tracker_name"] == "static"
    pd.testing.assert_frame_equal(revised[still], runs[still])
    assert list(revised["mean_overlap"][~still]) == list(runs[f"{REVISED}mean_overlap"][~still])
    assert with_revised_scores(runs[still]) is None


def test_captions_name_the_trace_of_revising_trackers(stored, tmp_path, run_trial):
    tables_by_name = {table.name: table for table in tables(Runs.open(stored))}
    assert list(tables_by_name) == ["summary", "sequences", "summary-revised", "sequences-revised"]
    for name, table in tables_by_name.items():
        words = "revised boxes"
        assert (words in table.caption) == name.endswith("-revised")
        assert ("online boxes" in table.caption) != (words in table.caption)
    first, last = (overlaps(tables_by_name[name]) for name in ("summary", "summary-revised"))
    assert first["static"] == last["static"]
    (other,) = set(first) - {"static"}
    assert first[other] != last[other]
    (alone,) = tables(Runs.open(run_trial(tmp_path, ["static"], ["plain/target:length=10"])))
    assert "boxes (" not in alone.caption


@pytest.fixture
def ran(trackmark, workspace):
    """Provide a folder with runs of a tracker that revises boxes and one that does not."""
    (workspace / "second_thoughts.py").write_text(SECOND_THOUGHTS)
    chosen = "static,second_thoughts.py:SecondThoughts"
    trackmark("run", "--trackers", chosen, "--sequences", "data/Small", "--name", "mine")
    return workspace


def pictured(workspace, words, steps, **options):
    """Draw the strip of both trackers; `words`: end of a label, `steps`: shift of its boxes."""
    sequence = datasets.load(str(workspace / "data" / "Small"))
    moved = sequence.boxes + [[step, 0, 0, 0] for step in steps]
    boxes = {TRUTH: sequence.boxes, "static": sequence.boxes}
    boxes |= {f"second_thoughts.py:SecondThoughts, {words}": moved}
    return film_strip(sequence.__getitem__, range(5), boxes, "Small", **options)


def test_pictures_name_the_trace_that_they_draw(trackmark, ran, blank_figures):
    online = pictured(ran, "online boxes", [0] * 5)
    show = ("show", "data/Small", "--results", "results/mine", "--output")
    trackmark(*show, "shown.png")
    np.testing.assert_array_equal(cv2.imread(str(ran / "shown.png")), online)
    trackmark(*show, "revised.png", "--trajectory", "revised")
    revised = pictured(ran, "revised boxes", [0, 0.5, 1, 1.5, 2])
    np.testing.assert_array_equal(cv2.imread(str(ran / "revised.png")), revised)
    trackmark("report", "results/mine", "--output", "report")
    strip = cv2.imread(str(ran / "report" / "strip-Small.png"))
    np.testing.assert_array_equal(strip, online)


def test_strips_have_the_colours_of_the_figures_of_a_report(ran):
    results, reviser = ran / "results" / "mine", "second_thoughts.py:SecondThoughts"
    (file,) = write_strips(Runs.open(results), ran, print, ["a", reviser, "static"])
    words = "online boxes"
    shades = {f"{reviser}, {words}": colour(1), "static": colour(2)}
    strip = pictured(ran, words, [0] * 5, shades=shades)
    np.testing.assert_array_equal(cv2.imread(str(file)), strip)


def test_trajectory_without_results_is_refused(trackmark):
    done = trackmark("show", "data/Small", "--trajectory", "revised", "--output", "a.png", status=2)
    assert "--trajectory" in done.stderr.splitlines()[-1]
    assert "requires --results" in done.stderr


def test_film_strips_are_limited_and_the_limit_is_named(trackmark, workspace, monkeypatch):
    shutil.copytree(workspace / "data" / "Small", workspace / "data" / "Other")
    trackmark("run", "--trackers", "static", "--sequences", "data/*", "--name", "mine")
    monkeypatch.setattr(film_strips, "MAX_STRIPS", 1)
    messages: list[str] = []
    files = write_strips(
        Runs.open(workspace / "results/mine"), workspace, messages.append, ["static"]
    )
    assert [file.name for file in files] == ["strip-Other.png"]
    assert messages == [
        "film strips: of the first 1 of 2 sequences. `trackmark show` draws others."
    ]
