"""What the files of all papers name is there: experiments, what they run, and sequences."""

import pandas as pd
import pytest

import datasets
from bench.experiments.contestant import contestant
from bench.experiments.experiment import read_experiment
from bench.papers import Effort, load_paper, paper_names
from bench.papers.context import Context, part_of
from datasets.text_form import format_text, parse_text

PAPERS = paper_names()


def described(name):
    paper = load_paper(name)
    context = Context(paper.description, paper.claims, None, None, Effort(), {}, pd.DataFrame())
    return paper, context


def without_scene(text):
    """A sequence's name with what of its knobs is unusual, but for the scene."""
    name, options = parse_text(text)
    usual = {knob["name"]: str(knob["default"]) for knob in datasets.options(name)}
    told = {key: value for key, value in options.items() if value != usual[key]}
    return format_text(name, dict(sorted(told.items() - {"scene": told.get("scene")}.items())))


@pytest.mark.parametrize("name", PAPERS)
def test_efforts_are_part_of_one_another_and_claims_are_judged_by_what_they_run(name):
    paper, _ = described(name)
    quick, default, whole = (
        {one.name for one in paper.experiments(effort)}
        for effort in (Effort(quick=True), Effort(), Effort(everything=True))
    )
    assert quick <= default < whole
    for claim in paper.claims.values():
        assert set(claim.experiment) <= whole, claim.id
        if claim.experiment:
            named = set(claim.experiment)
            assert named - default if claim.effort == "all" else named & default, claim.id


@pytest.mark.parametrize("name", PAPERS)
def test_a_quick_look_times_nothing_and_does_without_what_is_named(name):
    paper = load_paper(name)
    quick, default = (paper.experiments(Effort(quick=value)) for value in (True, False))
    assert not any(one.timing for one in quick)
    for left_out in paper.description.experiments.quick_without:
        parts = [f":{left_out}{end}" for end in ("", "=", ":")]

        def texts_with(experiments, parts=parts):
            texts = [f"{text}:" for one in experiments for text in one.trackers]
            return [text for text in texts if any(part in text for part in parts)]

        assert not texts_with(quick), left_out
        assert texts_with(default), left_out


@pytest.mark.parametrize("name", PAPERS)
def test_figures_show_what_their_experiments_run(name):
    paper, context = described(name)
    for figure in paper.description.figure.values():
        if figure.kind not in ("strip", "frames"):
            continue
        run = set()
        for one, sequence in zip(figure.experiments, figure.sequences, strict=True):
            experiment = read_experiment(paper.description.experiment(one))
            assert sequence in {without_scene(source.text) for source in experiment.sequences}
            run |= {contestant(text).label for text in experiment.trackers}
        panels = [{k: v for k, v in one.items() if k != "trace"} for one in figure.panels.values()]
        for text in figure.trackers:
            assert {context.text_of(text, sequence, panel) for panel in panels or [{}]} & run, text


@pytest.mark.parametrize("name", PAPERS)
def test_what_is_measured_on_scenes_is_measured_on_sequences_that_there_are(name):
    checks = part_of(name, "CHECKS", "scenes") or ()
    assert {one for check in checks for one in check.sequences} <= set(datasets.names())
