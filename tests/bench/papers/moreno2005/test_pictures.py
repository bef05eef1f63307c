"""Pictures of the tracker at work: that they show what it found, on a short scene."""

from types import SimpleNamespace

import cv2
import numpy as np
import pandas as pd
import pytest
from skimage import measure

import datasets
from bench.evaluation.loop import evaluate
from bench.experiments.contestant import contestant
from bench.experiments.experiment import read_experiment
from bench.metrics.regions import region_similarity
from bench.papers import drawing
from bench.papers.drawing import undrawn
from bench.papers.moreno2005 import FIGURES, figures, stages
from bench.papers.moreno2005.figures import (
    BASELINE,
    COMPARED,
    METHODS,
    NUMBERS,
    PRESETS,
    SHOWN,
    colour_path_figure,
    draw,
    film_strips,
    mean_colours,
)
from bench.papers.moreno2005.stages import (
    hypotheses_figure,
    model_of,
    palettes_of,
    snake_figure,
    step_of,
    true_contour,
)
from bench.papers.stored import StoredRuns
from datasets import Sequence
from reports.overlay import TRUTH
from trackers.contours.cells import colour_cells
from trackers.contours.outline import bounding_box, filled
from trackers.contours.posterior import posterior
from trackers.contours.snake import MARGIN, fitted_snake

NAME = "plain/target:length=11"
STEPS = 3
WRITTEN, RECOMMENDED = PRESETS.values()


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


@pytest.fixture(scope="module", params=PRESETS.values())
def label(request):
    return request.param


@pytest.fixture(scope="module")
def step(label, short_scene):
    return step_of(METHODS[label])


@pytest.fixture(scope="module")
def recommended(short_scene):
    return step_of(METHODS[RECOMMENDED])


@pytest.fixture(scope="module")
def model(scene):
    return model_of(scene)


def all_there(experiment, sequence, tracker):
    return [f"{experiment} {sequence} {tracker}"]


class TestOneStep:
    def test_it_is_that_of_a_run_as_experiments_make_it(self, scene, recommended):
        run = evaluate(METHODS[RECOMMENDED], scene, keep_arrays=True)
        for name, values in recommended.estimate.arrays.items():
            np.testing.assert_array_equal(values, run.arrays[STEPS][name])
        np.testing.assert_array_equal(recommended.image, scene[STEPS])
        np.testing.assert_array_equal(recommended.mask, scene.mask(STEPS))

    def test_what_the_cues_found_is_what_the_estimate_was_made_of(self, step):
        contours = step.contours
        np.testing.assert_allclose(
            np.average(contours.states, axis=0, weights=contours.weights),
            step.estimate.arrays["mean_contour"],
        )
        normals = np.cross(step.bases[:, :, 0], step.bases[:, :, 1])
        np.testing.assert_allclose(normals, step.planes.states, atol=1e-12)
        shown = step.estimate.arrays["posterior"]
        supported = pd.Series(contours.weights).groupby(contours.attached).sum().idxmax()
        np.testing.assert_array_equal(step.posterior(supported), shown)


class TestColourModel:
    def test_colours_are_of_their_regions(self, scene, model):
        image, mask = scene[0], scene.mask(0)
        for name, region in (("target", mask), ("background", ~mask)):
            there = {tuple(colour) for colour in image[region][:, ::-1].tolist()}
            drawn = np.round(255 * model.points[name]).astype(int)
            assert {tuple(colour) for colour in drawn.tolist()} <= there
        assert {name: len(points) for name, points in model.points.items()} == {
            "target": 500,
            "background": 1500,
        }

    def test_the_posterior_of_a_pixel_is_that_at_its_colour_on_the_plane(self, scene, model):
        x, y = model.grid
        pixels = scene[0][..., ::-1].reshape(-1, 3)[::997] / 255.0 @ model.basis
        rows, columns = (
            np.rint((pixels[:, 1] - y[0]) / (y[1] - y[0])),
            np.rint((pixels[:, 0] - x[0]) / (x[1] - x[0])),
        )
        inside = (rows >= 0) & (rows < len(y)) & (columns >= 0) & (columns < len(x))
        on_plane = model.on_plane[rows[inside].astype(int), columns[inside].astype(int)]
        on_image = model.on_image.ravel()[::997][inside]
        assert inside.mean() > 0.9
        assert np.mean(np.abs(on_plane - on_image) < 0.1) > 0.9

    def test_the_posterior_is_high_on_the_target(self, scene, model):
        mask = scene.mask(0)
        assert model.on_image[mask].mean() > 0.8 > 0.2 > model.on_image[~mask].mean()

    def test_mixtures_are_those_that_the_posterior_is_made_of(self, model):
        x, y = model.grid
        place = np.array([[x[40], y[90]]])
        expected = posterior(place, *model.mixtures.values(), floor=0.0)
        assert model.on_plane[90, 40] == pytest.approx(expected[0])

    def test_the_path_is_of_mean_colours_where_something_is_seen(self, scene):
        absent = Sequence(
            "made",
            [scene[0], scene[1]],
            np.zeros((2, 4)),
            fingerprint="made",
            masks=[scene.mask(0), np.zeros((240, 320), bool)].__getitem__,
        )
        path = mean_colours(absent)
        blue, green, red = scene[0][scene.mask(0)].mean(axis=0) / 255
        np.testing.assert_allclose(path[0], [red, green, blue])
        assert np.isnan(path[1]).all()

    def test_the_path_that_is_shown_is_that_of_the_strips_sequence(self, scene):
        figure = colour_path_figure()
        red = figure.axes[1].lines[0].get_ydata()
        np.testing.assert_allclose(red, mean_colours(scene)[:, 0])


class TestHypotheses:
    def test_colours_are_the_heaviest_the_median_and_the_lightest(self, step):
        palettes = palettes_of(step)
        weights = step.colours.weights
        ranked = np.sort(weights)[::-1]
        for (words, palette), place, name in zip(
            palettes.items(),
            (0, len(ranked) // 2, -1),
            ("greatest", "median", "least"),
            strict=True,
        ):
            assert words.startswith(f"{name} weight: {ranked[place] * len(ranked):.2g} ")
            assert any(
                weights[number] == ranked[place]
                and np.array_equal(step.posterior(number), palette.posterior)
                for number in range(len(weights))
            )

    def test_maps_belong_to_the_mixtures_beside_them(self, step, label):
        palette = next(iter(palettes_of(step).values()))
        cells = colour_cells(step.image, 20)
        plane = step.colours.attached[step.colours.weights.argmax()]
        expected = posterior(
            cells.colours @ step.bases[plane],
            *palette.mixtures.values(),
            floor=contestant(METHODS[label]).parameters["colour_floor"],
        )
        np.testing.assert_allclose(palette.posterior, expected[cells.image], atol=1e-3)

    def test_the_figure_says_what_it_is_not(self, recommended):
        figure = hypotheses_figure(recommended, RECOMMENDED)
        assert "not the paper's video" in figure.get_suptitle().replace("\n", " ")


class TestSnake:
    def test_the_snake_is_fitted_to_the_edges_that_are_shown(self, recommended):
        _, _, supported, mean, snake = stages.stages(recommended)
        assert recommended.estimate.details["snake"] == 1
        fitted = fitted_snake(mean.contour, supported.shown, (0, 0))
        np.testing.assert_allclose(fitted, snake.contour, atol=1e-9)

    def test_stages_are_of_the_same_part_of_the_image(self, recommended):
        first, edges, supported, mean, snake = stages.stages(recommended)
        arrays = recommended.estimate.arrays
        corner = arrays["contour"] - snake.contour
        np.testing.assert_allclose(corner, np.broadcast_to(corner[0], corner.shape))
        x, y = np.rint(corner[0]).astype(int)
        height, width = first.shown.shape
        box = bounding_box(arrays["mean_contour"])
        assert box[0] - x == pytest.approx(MARGIN, abs=1)
        assert box[1] + box[3] + MARGIN == pytest.approx(y + height, abs=1)
        window = np.s_[y : y + height, x : x + width]
        np.testing.assert_array_equal(first.shown, arrays["posterior"][window])
        np.testing.assert_array_equal(mean.shown, recommended.image[window])
        assert edges.shown.shape == supported.shown.shape == (height, width)
        assert edges.shown.mean() > supported.shown.mean()

    def test_titles_say_how_well_both_contours_fit(self, recommended):
        panels = stages.stages(recommended)
        for panel, name in zip(panels[3:], ("mean_contour", "contour"), strict=True):
            inside = filled(recommended.estimate.arrays[name], 240, 320)
            agree = region_similarity(inside, recommended.mask)
            assert panel.title.endswith(f"J = {agree:.2f}")

    def test_a_snake_that_was_not_taken_is_said_to_be_none(self, recommended):
        refused = recommended._replace(
            estimate=SimpleNamespace(arrays=recommended.estimate.arrays, details={"snake": 0.0})
        )
        said = [snake_figure(one, "").get_suptitle() for one in (recommended, refused)]
        assert ["not believed" in words.replace("\n", " ") for words in said] == [False, True]


@pytest.fixture(scope="module")
def made(short_scene):
    """All calls of `film_strip`."""
    calls = []

    def strip(
        image_of, numbers, boxes, title, columns, width, *, shape="", shades=None, words=None
    ):
        images = [image_of(number) for number in numbers]
        calls.append(
            SimpleNamespace(
                images=images,
                numbers=numbers,
                boxes=boxes,
                title=title,
                shape=shape,
                shades=shades,
                words=words,
            )
        )
        return np.zeros((10, 20, 3), np.uint8)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "film_strip", strip)
        found = film_strips(SimpleNamespace(of=all_there))
    assert {name: len(picture) for name, picture in found.items()} == {
        "figure-7": 30,
        "figure-7-recommended": 30,
        "figure-9": 30,
        "figure-9-recommended": 30,
    }
    return [calls[start : start + 3] for start in range(0, 12, 3)]


class TestStrips:
    def test_rows_are_frames_or_the_baseline_then_the_proposed_method_then_its_maps(self, made):
        assert [[list(row.boxes) for row in picture] for picture in made] == [
            [[], [TRUTH, WRITTEN], [TRUTH]],
            [[], [TRUTH, RECOMMENDED], [TRUTH]],
            [[TRUTH, BASELINE], [TRUTH, WRITTEN], [TRUTH]],
            [[TRUTH, BASELINE], [TRUTH, RECOMMENDED], [TRUTH]],
        ]
        for picture in made:
            assert "not the paper's video" in picture[0].title
            assert {tuple(row.numbers) for row in picture} == {(0, 2, 4, 6, 8, 10)}

    def test_contours_and_maps_are_those_of_the_runs_of_the_experiments(self, scene, made):
        texts = {
            WRITTEN: "moreno2005:preset=as-written",
            RECOMMENDED: "moreno2005:preset=recommended",
        }
        for label, (baseline, proposed, maps) in zip(texts, made[2:], strict=True):
            run = evaluate(texts[label], scene, keep_arrays=True)
            other = evaluate(
                texts[label].replace("moreno2005", "contour-smooth-color") + ":mixing=1",
                scene,
                keep_arrays=True,
            )
            for row, of, name in ((proposed, run, label), (baseline, other, BASELINE)):
                contours = row.boxes[name]
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

    def test_methods_have_the_colours_that_they_have_in_the_curves(self, made):
        shades = made[0][1].shades
        assert list(shades) == list(METHODS)

    def test_figures_without_all_their_runs_are_left_out(self):
        def of(experiment, sequence, tracker):
            return all_there("", "", "") * (experiment == FIGURES[7] and "written" in tracker)

        assert list(film_strips(SimpleNamespace(of=of))) == ["figure-7"]

    @pytest.mark.slow
    def test_what_is_shown_is_what_the_experiments_run(self):
        for number, shown in SHOWN.items():
            experiment = read_experiment(FIGURES[number])
            trackers = {contestant(text).label for text in experiment.trackers}
            first = [one.text for one in experiment.sequences if one.text.endswith("scene=0")]
            names = {datasets.load(text).name for text in first}
            assert datasets.load(shown).name in names
            for label in PRESETS.values():
                assert contestant(METHODS[label]).label in trackers
                if number in COMPARED:
                    baseline = METHODS[label].replace("moreno2005", "contour-smooth-color")
                    assert contestant(baseline).label in trackers

    def test_a_target_in_two_parts_has_two_outlines(self):
        mask = np.zeros((60, 80), bool)
        mask[10:30, 10:30] = mask[40:50, 50:75] = True
        parts = SimpleNamespace(mask=lambda frame: mask)
        contour = true_contour(parts, 0)
        gaps = np.flatnonzero(np.isnan(contour[:, 0]))
        assert len(gaps) == 2
        first, second = contour[: gaps[0]], contour[gaps[0] + 1 : gaps[1]]
        both = [
            measure.grid_points_in_poly((60, 80), one[:, ::-1] - 0.5) for one in (first, second)
        ]
        assert np.mean((both[0] | both[1]) == mask) > 0.99
        assert not (both[0] & both[1]).any()
        for nothing in (None, np.zeros((60, 80), bool)):
            unseen = SimpleNamespace(mask=lambda frame, nothing=nothing: nothing)
            assert true_contour(unseen, 0).shape == (0, 2)


@pytest.mark.slow
def test_every_picture_is_drawn_whole_in_the_papers_order(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "density_figure", lambda: None)
    monkeypatch.setattr(figures, "error_plot", lambda tables: None)
    monkeypatch.setattr(figures, "similarity_plots", lambda stored: {})
    monkeypatch.setattr(StoredRuns, "of", lambda self, *names: all_there(*names))
    paths = draw(tmp_path, tmp_path / "new", {}, {})
    assert [path.stem for path in paths] == [
        "figure-3",
        "figure-5",
        "figure-5-recommended",
        "figure-6",
        "figure-6-recommended",
        "figure-7",
        "figure-7-colours",
        "figure-7-recommended",
        "figure-9",
        "figure-9-recommended",
    ]
    for path in paths:
        assert min(cv2.imread(str(path)).shape[:2]) > 250
    assert undrawn(paths, NUMBERS) == ["Not drawn, for want of finished runs: Fig. 1, 2, 8, 10."]


def test_pictures_that_need_no_runs_are_drawn_without_any(tmp_path, monkeypatch):
    for name in ("density_figure", "error_plot", "similarity_plots"):
        monkeypatch.setattr(figures, name, lambda *_: {})
    for writer in ("write_figure", "write_film_strip"):
        monkeypatch.setattr(drawing, writer, lambda path, _: path)
    paths = draw(tmp_path, tmp_path, {}, {})
    assert undrawn(paths, NUMBERS) == ["Not drawn, for want of finished runs: Fig. 7, 8, 9, 10."]
