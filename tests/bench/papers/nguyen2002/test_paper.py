"""What a reproduction of the paper runs, by how much is asked for."""

from collections import Counter

from bench.experiments.experiment import SequenceSource
from bench.papers import Effort, load_paper
from bench.papers.nguyen2002 import COLOURED, LIGHTS, RECORDED, TABLE, TIMED, examined_scenes
from bench.papers.nguyen2002.measures import is_clip
from datasets.text_form import parse_text

PAPER = load_paper("nguyen2002")
SETTINGS, READINGS, ABLATIONS = (
    f"nguyen2002-{name}" for name in ("settings", "readings", "ablations")
)


def chosen(**effort):
    return {one.name: one for one in PAPER.experiments(Effort(**effort))}


def sets_in(experiment):
    """Number of clips by scene."""
    names = [parse_text(source.text) for source in experiment.sequences]
    return Counter(int(options["scene"]) for name, options in names if is_clip(name))


def test_table_and_figure_are_run_always_and_what_stands_beside_them_by_default():
    assert list(chosen()) == [LIGHTS, COLOURED, TABLE, TIMED, SETTINGS]
    assert list(chosen(quick=True)) == [LIGHTS, COLOURED, TABLE, TIMED]
    assert list(chosen(everything=True)) == [*chosen(), READINGS, ABLATIONS]


def test_sets_of_clips_are_whole_however_little_is_asked_for():
    assert sets_in(chosen()[TABLE]) == dict.fromkeys(range(10), 20)
    assert sets_in(chosen(quick=True)[TABLE]) == {0: 20, 1: 20}
    for name in (SETTINGS, READINGS, ABLATIONS):
        found = chosen(everything=True)[name]
        assert sets_in(found) == dict.fromkeys(range(10), 20)
        assert len(found.sequences) == 220


def test_the_recording_has_twenty_scenes_and_ten_with_coloured_lamps():
    names = [source.text for source in chosen()[LIGHTS].sequences]
    assert len(names) == len(set(names)) == 20
    assert len(chosen()[COLOURED].sequences) == 10
    assert [len(chosen(quick=True)[name].sequences) for name in (LIGHTS, COLOURED)] == [2, 1]


def test_what_is_measured_is_measured_on_the_scenes_of_figure_and_table():
    scenes = examined_scenes(Effort())
    assert len(scenes) == 220
    assert set(scenes) >= {source.text for source in chosen()[TABLE].sequences}


def test_recorded_sequences_are_tracked_by_all_features():
    experiment = chosen(recorded=(SequenceSource("samples/face"),))[RECORDED.name]
    texts = [text for text in experiment.trackers if "as-written" in text]
    features = [parse_text(text)[1]["features"] for text in texts]
    assert features == ["intensity", "rgb", "invariants", "arctan"]
    assert [source.text for source in experiment.sequences] == ["samples/face"]
