"""What a reproduction of the paper runs, by how much is asked for."""

from collections import Counter

from bench.experiment import SequenceSource
from bench.papers import Effort, load_paper
from bench.papers.moreno2005 import FIGURES, LIGHT, RECORDED, TIMED, examined_scenes
from bench.papers.moreno2005.criteria import REPETITIONS, SCENES
from bench.papers.moreno2005.scores import labels_of
from datasets.text_form import parse_text

PAPER = load_paper("moreno2005")
BESIDE = [f"moreno2005-{name}" for name in ("association", "shadow", "self-shadow", "kalman")]
FURTHER = [f"moreno2005-{name}" for name in ("ablations", "literal", "temperatures", "learnt")]


def chosen(**effort):
    return {one.name: one for one in PAPER.experiments(Effort(**effort))}


def test_figures_are_run_always_and_what_claims_need_by_default():
    always = [*FIGURES.values(), LIGHT, TIMED]
    assert list(chosen(quick=True)) == always
    assert list(chosen()) == [*always, *BESIDE]
    assert list(chosen(everything=True)) == [*always, *BESIDE, *FURTHER]


def test_every_claim_that_is_decided_over_scenes_has_enough_of_them():
    for experiment in chosen(everything=True).values():
        if experiment.timing:
            continue
        scenes = Counter()
        for source in experiment.sequences:
            name, options = parse_text(source.text)
            options.pop("scene")
            scenes[name, *options.values()] += 1
        assert min(scenes.values()) >= 8


def test_criteria_have_their_scenes_and_repetitions():
    both = chosen()
    for name in (FIGURES[7], LIGHT, "moreno2005-association"):
        scenes = {int(parse_text(one.text)[1]["scene"]) for one in both[name].sequences}
        assert scenes == set(SCENES)
        for text in both[name].trackers:
            if labels_of(text)["preset"] == "recommended":
                repetitions = both[name].repeated.get(text, both[name].repetitions)
                assert repetitions == len(REPETITIONS)


def test_a_quick_look_takes_the_first_scenes_once():
    for experiment in chosen(quick=True).values():
        assert {parse_text(s.text)[1].get("scene", "0") for s in experiment.sequences} == {"0"}
        assert experiment.repetitions == 1
    assert len(chosen(quick=True)[LIGHT].sequences) == 2


def test_fewer_repetitions_are_fewer_of_everything():
    for experiment in chosen(seeds=1, everything=True).values():
        assert experiment.repetitions == 1
        assert set(experiment.repeated.values()) <= {1}


def test_what_is_measured_is_measured_on_the_scenes_of_the_figures():
    scenes = examined_scenes(Effort())
    assert Counter(parse_text(name)[0] for name in scenes) == {
        "moreno2005/ellipse": 10, "moreno2005/octopus": 8, "moreno2005/book": 8,
        "moreno2005/leaf": 16,
    }  # fmt: skip


def test_recorded_sequences_are_tracked_by_both_presets_and_the_baseline():
    experiment = chosen(recorded=(SequenceSource("samples/face"),))[RECORDED.name]
    methods = [(labels_of(t)["method"], labels_of(t)["preset"]) for t in experiment.trackers[:-1]]
    assert {("proposed", "as-written"), ("proposed", "recommended")} < set(methods)
    assert ("baseline", "recommended") in methods
    assert experiment.trackers[-1] == "static"
