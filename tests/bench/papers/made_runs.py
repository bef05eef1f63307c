"""Rows of a described paper's runs, as its experiments ask for them, to be given scores by hand."""

from itertools import product

import pandas as pd

import datasets
from bench.experiments.contestant import contestant
from bench.papers.runs import labels_of
from datasets.text_form import format_text, parse_text


def made_runs(paper, effort):
    """A row a run and no score yet, as `bench.papers.runs.tidy_runs` labels it."""
    rows = {}
    for experiment in paper.experiments(effort):
        if experiment.timing:
            continue
        for text, source in product(experiment.trackers, experiment.sequences):
            label, name = contestant(text).label, canonical(source.text)
            labels = labels_of(label, name, paper.description.apart)
            for repetition in range(experiment.repeated.get(text, experiment.repetitions)):
                row = rows.setdefault((label, name, repetition), labels | {"experiments": ""})
                row["experiments"] += f",{experiment.name},"
                row["repetition"] = repetition
    usual = {"frames": 100, "failure": "", "kept_scene": True, "copied": False}
    return pd.DataFrame(rows.values()).assign(trace="online", **usual)


def canonical(text):
    """A sequence's name without knobs that say what is usual."""
    name, options = parse_text(text)
    usual = {knob["name"]: str(knob["default"]) for knob in datasets.options(name)}
    told = {key: value for key, value in options.items() if value != usual[key]}
    return format_text(name, dict(sorted(told.items())))
