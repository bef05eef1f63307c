"""Pictures: that they show what the tracker found on a short scene, and numbers that are known."""

from types import SimpleNamespace

import cv2
import numpy as np
import pandas as pd
import pytest
from skimage import measure

import datasets
from bench.evaluation.conducting import evaluate
from bench.experiments.contestant import contestant
from bench.experiments.experiment import read_experiment
from bench.metrics.regions import region_similarity
from bench.papers import Effort, load_paper
from bench.papers.context import Context, hook
from bench.papers.figures import draw_figure, write_pictures
from bench.papers.moreno2005 import figures, stages
from bench.papers.moreno2005.figures import (
    BASELINE,
    COMPARED,
    FILTERS,
    METHODS,
    PRESETS,
    SHOWN,
    colour_path_figure,
    density_figure,
    error_plot,
    film_strips,
    mean_colours,
)
from bench.papers.moreno2005.stages import model_of, palettes_of, snake_figure, true_contour
from reports.overlay import TRUTH
from trackers.contours.outline import bounding_box, filled
from trackers.contours.posterior import posterior
from trackers.contours.snake import ELASTICITY, MARGIN, RIGIDITY, SPACING, fitted_snake

NAME = "plain/target:length=11"
STEPS = 3
WRITTEN, RECOMMENDED = PRESETS.values()
PAPER = load_paper("moreno2005")


@pytest.fixture(scope="module", autouse=True)
def short_scene():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "SEQUENCE", NAME)
        patch.setattr(stages, "STEPS", STEPS)
        patch.setattr(figures, "SHOWN", {7: NAME, 9: NAME})
        yield


@pytest.fixture(scope="module")
def scene():
    return datasets.load(NAME)


@pytest.fixture(scope="module")
def step(short_scene):
    return stages.step_of(METHODS[RECOMMENDED])


@pytest.fixture(scope="module")
def model(scene):
    return model_of(scene)


def context(tables=None, **stored):
    """What hooks are told, with runs that there are."""
    known = Context(PAPER.description, PAPER.claims, None, None, Effort(), {}, pd.DataFrame())
    known.tables.update(tables or {})
    vars(known)["stored"] = SimpleNamespace(**stored)
    return known


def all_there(experiment, sequence, tracker):
    return [f"{experiment} {sequence} {tracker}"]


def test_a_step_is_that_of_a_run_as_experiments_make_it(scene, step):
    run = evaluate(METHODS[RECOMMENDED], scene, keep_arrays=True)
    for name, values in step.estimate.arrays.items():
        np.testing.assert_array_equal(values, run.arrays[STEPS][name])
    np.testing.assert_array_equal(step.image, scene[STEPS])
    np.testing.assert_array_equal(step.mask, scene.mask(STEPS))


@pytest.mark.parametrize("label", PRESETS.values())
def test_what_the_cues_found_is_what_the_estimate_was_made_of(label):
    step = stages.step_of(METHODS[label])
    contours = step.contours
    mean = np.average(contours.states, axis=0, weights=contours.weights)
    np.testing.assert_allclose(mean, step.estimate.arrays["mean_contour"])
    normals = np.cross(step.bases[:, :, 0], step.bases[:, :, 1])
    np.testing.assert_allclose(normals, step.planes.states, atol=1e-12)
    supported = pd.Series(contours.weights).groupby(contours.attached).sum().idxmax()
    np.testing.assert_array_equal(step.posterior(supported), step.estimate.arrays["posterior"])


def test_colours_of_the_model_are_of_their_regions(scene, model):
    image, mask = scene[0], scene.mask(0)
    for (name, region), number in zip(
        (("target", mask), ("background", ~mask)), (500, 1500), strict=True
    ):
        there = {tuple(colour) for colour in image[region][:, ::-1].tolist()}
        drawn = np.round(255 * model.points[name]).astype(int)
        assert {tuple(colour) for colour in drawn.tolist()} <= there
        assert len(drawn) == number


def test_the_posterior_of_a_pixel_is_that_at_its_colour_on_the_plane(scene, model):
    x, y = model.grid
    place = np.array([[x[40], y[90]]])
    expected = posterior(place, *model.mixtures.values(), floor=0.0)
    assert model.on_plane[90, 40] == pytest.approx(expected[0])
    pixels = scene[0][..., ::-1].reshape(-1, 3)[::997] / 255.0 @ model.basis
    rows = np.rint((pixels[:, 1] - y[0]) / (y[1] - y[0])).astype(int)
    columns = np.rint((pixels[:, 0] - x[0]) / (x[1] - x[0])).astype(int)
    inside = (rows >= 0) & (rows < len(y)) & (columns >= 0) & (columns < len(x))
    on_image = model.on_image.ravel()[::997][inside]
    assert inside.mean() > 0.9
    assert np.mean(np.abs(model.on_plane[rows[inside], columns[inside]] - on_image) < 0.1) > 0.9


def test_the_path_of_the_strips_sequence_is_of_mean_colours_where_something_is_seen(scene):
    none = np.zeros((240, 320), bool)
    absent = datasets.Sequence(
        "made",
        [scene[0], scene[1]],
        np.zeros((2, 4)),
        fingerprint="made",
        masks=[scene.mask(0), none].__getitem__,
    )
    path = mean_colours(absent)
    np.testing.assert_allclose(path[0], scene[0][scene.mask(0)].mean(axis=0)[::-1] / 255)
    assert np.isnan(path[1]).all()
    red = colour_path_figure(None).axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(red, mean_colours(scene)[:, 0])


def test_hypotheses_are_the_heaviest_the_median_and_the_lightest_with_their_own_maps(step):
    palettes = palettes_of(step)
    ranked = np.sort(step.colours.weights)[::-1]
    for (words, palette), place, name in zip(
        palettes.items(),
        (0, len(ranked) // 2, -1),
        ("greatest", "median", "least"),
        strict=True,
    ):
        assert words.startswith(f"{name} weight: {ranked[place] * len(ranked):.2g} ")
        (number, *_) = (
            number
            for number in np.flatnonzero(step.colours.weights == ranked[place])
            if np.array_equal(step.posterior(number), palette.posterior)
        )
        cells = stages.colour_cells(step.image, 20)
        expected = posterior(
            cells.colours @ step.bases[step.colours.attached[number]],
            *palette.mixtures.values(),
            floor=contestant(METHODS[RECOMMENDED]).parameters["colour_floor"],
        )
        np.testing.assert_allclose(palette.posterior, expected[cells.image], atol=1e-3)


def test_stages_are_of_the_part_of_the_image_in_which_the_snake_is_fitted(step):
    first, edges, supported, mean, snake = stages.stages(step)
    arrays = step.estimate.arrays
    corner = arrays["contour"] - snake.contour
    np.testing.assert_allclose(corner, np.broadcast_to(corner[0], corner.shape))
    x, y = np.rint(corner[0]).astype(int)
    height, width = first.shown.shape
    box = bounding_box(arrays["mean_contour"])
    assert box[0] - x == pytest.approx(MARGIN, abs=1)
    assert box[1] + box[3] + MARGIN == pytest.approx(y + height, abs=1)
    window = np.s_[y : y + height, x : x + width]
    np.testing.assert_array_equal(first.shown, arrays["posterior"][window])
    np.testing.assert_array_equal(mean.shown, step.image[window])
    assert edges.shown.mean() > supported.shown.mean()
    assert step.estimate.details["snake"] == 1
    sides = np.linalg.norm(np.diff(mean.contour, axis=0, append=mean.contour[:1]), axis=1)
    ratio = SPACING / sides.mean()
    weights = ELASTICITY * ratio**2, RIGIDITY * ratio**4
    fitted = fitted_snake(mean.contour, supported.shown, (0, 0), *weights)
    np.testing.assert_allclose(fitted, snake.contour, atol=1e-9)
    for panel, name in ((mean, "mean_contour"), (snake, "contour")):
        agree = region_similarity(filled(arrays[name], 240, 320), step.mask)
        assert panel.title.endswith(f"J = {agree:.2f}")


def test_a_snake_that_was_not_taken_is_said_to_be_none(step):
    refused = SimpleNamespace(arrays=step.estimate.arrays, details={"snake": 0.0})
    both = step, step._replace(estimate=refused)
    said = [snake_figure(one, "").get_suptitle().replace("\n", " ") for one in both]
    assert ["not believed" in words for words in said] == [False, True]


@pytest.fixture(scope="module")
def made(short_scene):
    """All calls of `film_strip`, three a picture."""
    calls = []

    def strip(image_of, numbers, boxes, title, *where, shape="", shades=None, words=None):
        images = [image_of(number) for number in numbers]
        told = {"numbers": numbers, "boxes": boxes, "title": title, "words": words}
        calls.append(SimpleNamespace(images=images, shades=shades, **told))
        return np.zeros((10, 20, 3), np.uint8)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "film_strip", strip)
        found = film_strips(context(of=all_there))
    names = ["figure-7", "figure-7-recommended", "figure-9", "figure-9-recommended"]
    assert {name: len(picture) for name, picture in found.items()} == dict.fromkeys(names, 30)
    return [calls[start : start + 3] for start in range(0, 12, 3)]


def test_rows_are_frames_or_the_baseline_then_the_proposed_method_then_its_maps(made):
    assert [[list(row.boxes) for row in picture] for picture in made] == [
        [[], [TRUTH, WRITTEN], [TRUTH]],
        [[], [TRUTH, RECOMMENDED], [TRUTH]],
        [[TRUTH, BASELINE], [TRUTH, WRITTEN], [TRUTH]],
        [[TRUTH, BASELINE], [TRUTH, RECOMMENDED], [TRUTH]],
    ]
    for picture in made:
        assert "not the paper's video" in picture[0].title
        assert {tuple(row.numbers) for row in picture} == {(0, 2, 4, 6, 8, 10)}
    assert list(made[0][1].shades) == [*METHODS, BASELINE]


def test_contours_and_maps_are_those_of_the_runs_of_the_experiments(scene, made):
    for preset, (baseline, proposed, maps) in zip(
        ("as-written", "recommended"), made[2:], strict=True
    ):
        run = evaluate(f"moreno2005:preset={preset}", scene, keep_arrays=True)
        other = f"contour-smooth-color:preset={preset}:mixing=1"
        other = evaluate(other, scene, keep_arrays=True)
        for row, of in ((proposed, run), (baseline, other)):
            contours = list(row.boxes.values())[1]
            assert contours[0].shape == (0, 2)
            for number in row.numbers[1:]:
                np.testing.assert_array_equal(contours[number], of.arrays[number]["contour"])
                value = of.segmentation.region_similarity[number]
                assert row.words[number] == f"(J = {value:.2f})"
            assert row.words[0] == "(given)"
        assert len(np.unique(maps.images[0])) == 1
        for number, image in zip(maps.numbers[1:], maps.images[1:], strict=True):
            expected = 255 * run.arrays[number]["posterior"]
            assert np.abs(image - expected[..., np.newaxis]).max() <= 0.5 + 1e-4


def test_strips_without_all_their_runs_are_left_out():
    def of(experiment, sequence, tracker):
        return all_there("", "", "") * (experiment.endswith("figure-7") and "written" in tracker)

    made = film_strips(context(of=of))
    assert [name for name, picture in made.items() if picture is not None] == ["figure-7"]


@pytest.mark.slow
def test_what_is_shown_is_what_the_experiments_run():
    for number, shown in SHOWN.items():
        experiment = read_experiment(f"moreno2005-figure-{number}")
        trackers = {contestant(text).label for text in experiment.trackers}
        first = [one.text for one in experiment.sequences if ":scene=40" in one.text]
        assert datasets.load(shown).name in {datasets.load(text).name for text in first}
        for label in PRESETS.values():
            assert contestant(METHODS[label]).label in trackers
            if number in COMPARED:
                baseline = METHODS[label].replace("moreno2005", "contour-smooth-color")
                assert contestant(baseline).label in trackers


def test_a_target_in_two_parts_has_two_outlines():
    mask = np.zeros((60, 80), bool)
    mask[10:30, 10:30] = mask[40:50, 50:75] = True
    contour = true_contour(SimpleNamespace(mask=lambda frame: mask), 0)
    gaps = np.flatnonzero(np.isnan(contour[:, 0]))
    assert len(gaps) == 2
    first, second = contour[: gaps[0]], contour[gaps[0] + 1 : gaps[1]]
    both = [measure.grid_points_in_poly((60, 80), one[:, ::-1] - 0.5) for one in (first, second)]
    assert np.mean((both[0] | both[1]) == mask) > 0.99
    assert not (both[0] & both[1]).any()
    for nothing in (None, np.zeros((60, 80), bool)):
        unseen = SimpleNamespace(mask=lambda frame, nothing=nothing: nothing)
        assert true_contour(unseen, 0).shape == (0, 2)


@pytest.mark.slow
def test_every_picture_is_drawn_whole(tmp_path):
    known = context(of=all_there)
    hooks = ("figure-1", "figure-3", "steps", "figure-7-colours", "strips")
    pictures = {}
    for name in hooks:
        made = hook("moreno2005", PAPER.description.figure[name].hook)(known)
        pictures |= made if isinstance(made, dict) else {name: made}
    paths = write_pictures(tmp_path / "new", pictures)
    names = ["1", "3", "5", "5-recommended", "6", "6-recommended", "7", "7-colours"]
    names += ["7-recommended", "9", "9-recommended"]
    assert [path.stem for path in paths] == [f"figure-{name}" for name in names]
    for path in paths:
        assert min(cv2.imread(str(path)).shape[:2]) > 250


def test_fig_1_has_three_densities_before_and_after():
    figure = density_figure(None)
    assert len(figure.axes) == 6
    assert figure.axes[0].get_ylabel().startswith("t - 1")
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[:3] == ["true, t - 1", "estimated, t - 1", "observed, t - 1"]


def test_fig_2_has_a_panel_a_set_and_a_line_a_filter():
    errors = pd.DataFrame(
        {
            "set": name,
            "samples": number,
            "filter": kind,
            "repetition": repetition,
            "error": 0.1 * place + 1 / number + 0.01 * repetition,
        }
        for name in "AG"
        for number in (10, 500)
        for place, kind in enumerate(FILTERS)
        for repetition in (0, 1)
    )
    left, right = error_plot(context({"one-dimensional-errors": errors})).axes
    assert left.get_title() == "A: λ = 1, σ_obs = 0.1"
    assert right.get_title() == "G: λ = 0.2, σ_obs = 0.2"
    for place, container in enumerate(left.containers):
        assert container[0].get_xdata().tolist() == [10, 500]
        expected = np.array([0.1, 0.002]) + 0.1 * place + 0.005
        np.testing.assert_allclose(np.asarray(container[0].get_ydata(), float), expected)


def test_j_over_frames_is_the_median_over_scenes_of_means_over_repetitions():
    def of(experiment, sequence, tracker):
        scene = int(sequence[-1])
        values = [np.array([np.nan, 0.4, 0.4 + 0.2 * scene + 0.1 * r]) for r in (0, 1)]
        runs = [SimpleNamespace(segmentation=SimpleNamespace(region_similarity=v)) for v in values]
        return [] if "as-written" in tracker else runs

    def sequences(experiment):
        variants = ("book", "leaf", "leaf:jump=middle")
        return [f"moreno2005/{name}:scene={scene}" for name in variants for scene in (0, 1)]

    entry = PAPER.description.figure["similarity-figures"]
    stored = {"of": of, "sequences": sequences, "truth": lambda *_: None}
    axes = draw_figure(entry, context(**stored)).axes
    assert [one.get_title() for one in axes] == ["book", "leaf", "leaf:jump=middle"]
    lines = {line.get_label(): line for line in axes[1].lines}
    assert list(lines) == [label for label in entry.labels if label != "as written"]
    for line in lines.values():
        assert np.isnan(line.get_ydata()[0])
        assert line.get_ydata()[1:] == pytest.approx([0.4, 0.55])
    assert draw_figure(entry, context(**stored | {"of": lambda *_: []})) is None
