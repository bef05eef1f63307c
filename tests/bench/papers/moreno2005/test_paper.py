"""What a reproduction of the paper runs, by how much is asked for."""

from collections import Counter

from bench.experiments.contestant import contestant
from bench.experiments.experiment import SequenceSource, read_experiment
from bench.papers import Effort, load_paper
from bench.papers.moreno2005 import FIGURES, LIGHT, RECORDED, TIMED, examined_scenes
from bench.papers.moreno2005.learnt import is_deviation
from bench.papers.moreno2005.scores import labels_of
from datasets.text_form import parse_text

PAPER = load_paper("moreno2005")
BESIDE = [
    f"moreno2005-{name}" for name in ("association", "shadow", "self-shadow", "kalman", "moderate")
]
FURTHER = [
    f"moreno2005-{name}" for name in ("ablations", "diagonal", "literal", "temperatures", "learnt")
]


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


def test_what_a_verdict_as_written_or_recommended_rests_on_most_is_repeated():
    for number, experiment in enumerate(chosen()[name] for name in FIGURES.values()):
        for text in experiment.trackers:
            labels = labels_of(text)
            once = labels["preset"] == "robust" or labels["mixing"] in ("0.5", "0.3")
            once |= labels["plane"] == "refitted"
            assert experiment.repeated.get(text, 3) == (1 if once else 3), (number, text)


def test_learnt_deviations_and_those_by_hand_are_those_of_the_presets():
    for text, other in zip(
        read_experiment("moreno2005-learnt").trackers, ("recommended", "as-written"), strict=True
    ):
        given, others = contestant(text), contestant(f"moreno2005:preset={other}")
        own = contestant(f"moreno2005:preset={given.preset}")
        for name, value in given.parameters.items():
            source = others if is_deviation(name) else own
            assert value == source.parameters[name], name


def test_robust_stands_in_every_figure_with_the_baseline_of_its_preset():
    for name in FIGURES.values():
        labels = [labels_of(text) for text in chosen()[name].trackers]
        robust = [label for label in labels if label["preset"] == "robust"]
        assert {label["method"] for label in robust} == {"proposed", "baseline"}
        mixings = {label["mixing"] for label in robust} - {"any"}
        assert mixings == ({"1"} if name == FIGURES[8] else {"1", "0.5", "0.3"})


def test_moderate_clutter_has_scenes_of_its_own_and_says_that_it_is_post_hoc():
    every = chosen(everything=True)
    moderate = every.pop("moreno2005-moderate")
    assert "post hoc" in moderate.title
    options = [parse_text(source.text)[1] for source in moderate.sequences]
    assert {option["clutter"] for option in options} == {"moderate"}
    assert {int(option["scene"]) for option in options} == set(range(10, 20))
    assert {option.get("light", "even") for option in options} == {"even", "jump", "repeated"}
    others = [source.text for one in every.values() for source in one.sequences]
    assert not any(
        "clutter" in text or "scene=1" + str(n) in text for text in others for n in "0123456789"
    )


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
        "moreno2005/ellipse": 10,
        "moreno2005/octopus": 8,
        "moreno2005/book": 8,
        "moreno2005/leaf": 16,
    }


def test_recorded_sequences_are_tracked_by_both_presets_and_the_baseline():
    experiment = chosen(recorded=(SequenceSource("samples/face"),))[RECORDED.name]
    methods = [(labels_of(t)["method"], labels_of(t)["preset"]) for t in experiment.trackers[:-1]]
    assert {("proposed", "as-written"), ("proposed", "recommended")} < set(methods)
    assert ("baseline", "recommended") in methods
    assert experiment.trackers[-1] == "static"
