"""`trackmark learn`, as a user types it and on a film that is known."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import datasets
import trackers
from bench.commands.learn import command
from bench.experiments.experiment import ExperimentError
from trackers.contours.dynamics import LEARNT, read_dynamics


def film(name, masks=True, n=6):
    """A red square that goes two pixels right each frame, and three down."""
    images, squares = [], []
    ground = np.random.default_rng(0).integers(90, 160, (90, 160, 3), dtype=np.uint8)
    for i in range(n):
        square = np.zeros((90, 160), bool)
        square[20 + 3 * i : 50 + 3 * i, 30 + 2 * i : 60 + 2 * i] = True
        image = ground.copy()
        image[square, 2] = 230
        images.append(image)
        squares.append(square)
    return datasets.Sequence(
        name, images, fingerprint="abc", masks=squares.__getitem__ if masks else None
    )


@pytest.fixture
def learn(monkeypatch, tmp_path):
    """Type it where sequences called film, more and bare are known."""
    known = {"film": film("film"), "more": film("more"), "bare": film("bare", masks=False)}
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(datasets, "load", known.__getitem__)

    def typed(*arguments):
        return CliRunner().invoke(command, arguments, catch_exceptions=False).output

    return typed


def test_the_file_holds_the_values_and_what_they_come_from(learn):
    said = learn("film", "--output", "dynamics.toml")
    assert "dynamics.toml: 15 values from 5 steps" in said
    values = read_dynamics("dynamics.toml")
    assert tuple(values) == LEARNT
    assert values["shift_x_spread"] == pytest.approx(4, abs=0.2)  # in an image 320 wide
    assert values["shift_y_spread"] == pytest.approx(6, abs=0.2)
    origin = tomllib.loads(Path("dynamics.toml").read_text())["learnt"]
    assert origin["colour_dynamics"] == "shared"
    assert origin["sequences"] == [{"name": "film", "fingerprint": "abc", "frames": 6, "steps": 5}]


def test_it_is_printed_as_the_file_or_as_json(learn):
    printed = tomllib.loads(learn("film"))
    told = json.loads(learn("film", "--json"))
    assert told.pop("learnt") == printed.pop("learnt")
    assert told == pytest.approx(printed, rel=1e-3)


def test_sequences_are_pooled(learn):
    told = json.loads(learn("film, more", "--json", "--colour-dynamics", "diagonal"))
    assert [origin["steps"] for origin in told["learnt"]["sequences"]] == [5, 5]
    assert "gain_spread" not in told


def test_a_sequence_without_masks_is_refused(learn):
    with pytest.raises(ExperimentError, match=r"^bare: no two frames on end have masks"):
        learn("film,bare")


def test_a_file_is_replaced_only_by_force(learn):
    learn("film", "--output", "dynamics.toml")
    with pytest.raises(ExperimentError, match="--force"):
        learn("film", "--output", "dynamics.toml")
    assert "15 values" in learn("film", "--output", "dynamics.toml", "--force")


def test_a_file_that_cannot_be_written_is_named(learn):
    Path("file").write_text("")
    with pytest.raises(NotADirectoryError, match="cannot write") as raised:
        learn("film", "--output", "file/dynamics.toml")
    assert raised.value.filename == "file/dynamics.toml"


def test_what_is_wrong_is_said_in_one_line(trackmark):
    said = trackmark("learn", "samples/face", status=2).stderr
    assert said.splitlines() == [
        "trackmark: samples/face: no two frames on end have masks, so there is no step to learn "
        "from."
    ]


@pytest.mark.slow
def test_learnt_dynamics_are_taken_by_the_tracker(trackmark, here):
    said = trackmark("learn", "moreno2005/ellipse:scene=100", "--output", "learnt.toml").stdout
    assert "learnt.toml: 15 values from 99 steps" in said
    tracker = "moreno2005:dynamics=learnt.toml"
    trackmark("run", "--trackers", tracker, "--sequences", "data/Small")


@pytest.mark.slow
def test_the_preset_as_written_has_what_is_learnt_on_two_ellipses():
    training = ",".join(f"moreno2005/ellipse:scene={number}" for number in (100, 101))
    options = [training, "--colour-dynamics", "diagonal", "--json"]
    values = json.loads(CliRunner().invoke(command, options, catch_exceptions=False).stdout)
    for name in ("moreno2005", "contour-smooth-color"):
        preset = trackers.describe(name)["presets"]["as-written"]
        deviations = {key: value for key, value in preset.items() if key.endswith("_spread")}
        assert len(deviations) >= 6
        assert deviations == pytest.approx({key: values[key] for key in deviations}, rel=5e-4)
