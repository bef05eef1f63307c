"""Where everything is at any time: functions of time, in image coordinates."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.plain.knobs import TargetKnobs
from trackmark.datasets.synthetic.render.path import Loop, quantised, random_loop, smooth_step
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

COLUMNS = 256  # columns by which the silhouette's area is measured


class TargetMotion:
    """Motion, size and light of a target's scene.

    Attributes
    ----------
    power : int
        The silhouette is the superellipse of this power.
    half_size : ndarray of float64, shape (2,)
        Half width and half height of the target in the first frame, in pixels.
    occlusion_frame : int
        When the board hides the most.
    board_width : float
        In pixels; 0 without occlusion.
    pan : ndarray of float64, shape (2,)
        Velocity of the window over the ground [pixels/frame].
    distractors : list of Loop
        Paths of the distractors' centres.
    """

    def __init__(self, knobs: TargetKnobs) -> None:
        self.knobs = knobs
        self.size = np.array([knobs.width, knobs.height], np.float64)
        random = part_generator(knobs.scene, "target shape")
        self.power = int(random.choice([2, 4]))
        aspect = random.uniform(1.0, 1.45)
        half_height = min(knobs.height, knobs.width / 1.45) * random.uniform(0.085, 0.105)
        self.half_size = quantised(np.array([aspect, 1.0]) * half_height)

        random = part_generator(knobs.scene, "target path")
        margin = self.half_size * max(1.0, knobs.scale) + 3
        self._loop = random_loop(random, margin, self.size - margin, knobs.speed)

        random = part_generator(knobs.scene, "camera")
        across = random.uniform(0.8, 1.0)
        direction = np.array([across, np.sqrt(1 - across * across)]) * random.choice([-1, 1], 2)
        self.pan = knobs.pan * direction
        self._cloud_side = float(random.choice([-1, 1]))
        self.distractors = [
            self._distractor_path(part_generator(knobs.scene, f"distractor path {i}"))
            for i in range(knobs.clutter)
        ]
        self._set_exit()
        self._set_board()

    def _distractor_path(self, random: np.random.Generator) -> Loop:
        middle = self.size * random.uniform(0.25, 0.75, 2)
        half = self.size * random.uniform(0.15, 0.45, 2)
        return random_loop(random, middle - half, middle + half, self.knobs.speed)

    def _set_exit(self) -> None:
        """Edge by which the target leaves: the nearest one."""
        n, absence = self.knobs.length, self.knobs.absence
        self._leaves = round(2 * n / 3 - absence / 2)
        self._returns = self._leaves + absence - 1
        self._exit_time = max(2, min(30, n // 8))
        place = self._loop.at((self._leaves + self._returns) / 2)
        distances = np.concatenate([place, self.size - place])
        edge = int(np.argmin(distances))
        self._exit_axis, self._exit_high = edge % 2, edge >= 2

    def _set_board(self) -> None:
        """Width and speed of the board: it hides `occlusion` when over the middle."""
        self.occlusion_frame = round(self.knobs.length / 3)
        self.board_width = self._board_middle = self._board_velocity = 0.0
        if self.knobs.occlusion == 0:
            return
        half_width = self.half_size[0] * self.scale(self.occlusion_frame)
        _, chord = columns_of_silhouette(self.power)
        inner = np.concatenate([[0.0], np.cumsum(chord[COLUMNS // 2 :])]) / chord.sum() * 2
        edges = np.linspace(0, 1, len(inner))
        reach = float(np.interp(self.knobs.occlusion, inner, edges))
        self.board_width = 2 * half_width * reach + (4 if self.knobs.occlusion == 1 else 0)
        room = self.half_size[0] * max(1.0, self.knobs.scale) + self.board_width / 2 + 2
        pace = max(0.01 * self.knobs.height, room / self.occlusion_frame)
        side = part_generator(self.knobs.scene, "board path").choice([-1, 1])
        self._board_velocity = float(side) * (pace + 1.5 * self.knobs.speed)
        self._board_middle = float(self.centre(self.occlusion_frame)[0])

    def scale(self, times: ArrayLike) -> Array:
        """Size over that in the first frame."""
        progress = np.asarray(times, np.float64) / (self.knobs.length - 1)
        return np.round(np.power(self.knobs.scale, progress) * 1024) / 1024

    def centre(self, times: ArrayLike) -> Array:
        """Target's centre (x, y) [pixels], shape `times.shape + (2,)`."""
        times = np.asarray(times, np.float64)
        place = self._loop.at(times)
        if self.knobs.absence > 0:
            early = np.maximum(self._leaves - times, times - self._returns)
            out = np.clip(1 - np.maximum(early, 0) / self._exit_time, 0, 1)
            beyond = self.half_size[self._exit_axis] * self.scale(times) + 1
            goal = self.size[self._exit_axis] + beyond if self._exit_high else -beyond
            place[..., self._exit_axis] += out * out * (goal - place[..., self._exit_axis])
        return quantised(place)

    def board(self, times: ArrayLike) -> Array:
        """Middle (x) of the board [pixels]."""
        elapsed = np.asarray(times, np.float64) - self.occlusion_frame
        return quantised(self._board_middle + self._board_velocity * elapsed)

    def window(self, frame: int) -> Array:
        """Corner (x, y) of the picture over the ground [pixels]."""
        return quantised(self.pan * frame)

    def light(self, times: ArrayLike, across: ArrayLike) -> Array:
        """Gain of the light at times and places across the picture (in [-1, 1])."""
        progress = np.asarray(times, np.float64) / (self.knobs.length - 1)
        cloud = _passing_cloud(progress, self._cloud_side * np.asarray(across, np.float64))
        return 1 - self.knobs.light * cloud


def columns_of_silhouette(power: int) -> tuple[Array, Array]:
    """Middles x and half chords of a unit superellipse's columns, shape (COLUMNS,) each."""
    x = (np.arange(COLUMNS) + 0.5) / COLUMNS * 2 - 1
    chord = np.sqrt(1 - x * x) if power == 2 else np.sqrt(np.sqrt(1 - x * x * x * x))
    return x, chord


def _passing_cloud(
    progress: NDArray[np.float64], across: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How far a cloud takes the sun, in [0, 1], after a fraction of the sequence.

    The shade crosses the picture from one side, `across` which places are in [-1, 1]: none at the
    start, everywhere in the middle, none at the end.
    """
    phase = progress - 0.08 * across
    return smooth_step(phase, 0.15, 0.4) - smooth_step(phase, 0.6, 0.85)
