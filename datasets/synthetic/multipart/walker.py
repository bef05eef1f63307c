"""Renderer of a clothed walking person in any gait phase, heading and size.

Lengths of the body are fractions of the standing height. The body faces forward.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.multipart.look import (
    AROUND,
    WalkerLook,
    paint_part,
    silhouette,
    wrap_textures,
)
from trackmark.datasets.synthetic.render.prop import Coverage
from trackmark.datasets.synthetic.render.sprite import Sprite, superellipse

PARTS = (
    "left leg", "right leg", "left shoe", "right shoe",
    "left arm", "right arm", "torso", "head", "pack",
)  # fmt: skip

NODES = 9
_THIGH, _SHANK, _ANKLE = 0.245, 0.235, 0.045
_EXPOSURE = 0.02  # fraction of a gait cycle that passes during the exposure at full stride


@njit(cache=True)
def _leg_angles(phase: float, stride: float) -> tuple[float, float]:
    """Return hip angle (forward positive) and knee flexion of the left leg [radians]."""
    turn = 2 * np.pi * phase
    hip = stride * (0.36 * np.sin(turn) + 0.09)
    swing = max(0.0, np.cos(turn + 0.2))
    return hip, 0.06 + stride * (0.95 * swing**3 + 0.12 * max(0.0, -np.sin(turn + 0.6)))


@njit(cache=True)
def _skeleton(phase: float, stride: float, forward: float, side: float, build: Array) -> Array:
    """Return nodes of all parts, shape (parts, nodes, 4).

    The columns are height, sideways offset, half width, and position along the part in [0, 1].
    `forward` and `side` are the components to the right, in the image, of the body's forward and
    left direction: cosine and sine of the heading.
    """
    parts = np.zeros((9, NODES, 4))
    bulk, sleeve, hem, loose = build[0], build[1], build[2], build[3]
    hips = 0.0
    angles = np.zeros((2, 2))
    for leg in range(2):
        angles[leg] = _leg_angles(phase + 0.5 * leg, stride)
        reach = _THIGH * np.cos(angles[leg, 0]) + _SHANK * np.cos(angles[leg, 0] - angles[leg, 1])
        hips = max(hips, reach + _ANKLE)
    bob = hips - (_THIGH + _SHANK + _ANKLE)
    for leg in range(2):
        lateral = 0.048 if leg == 0 else -0.048
        hip, knee = angles[leg]
        lower = hip - knee
        knee_x = lateral * side + _THIGH * np.sin(hip) * forward
        knee_y = hips - _THIGH * np.cos(hip)
        ankle_x = knee_x + _SHANK * np.sin(lower) * forward
        ankle_y = knee_y - _SHANK * np.cos(lower)
        for k in range(NODES):
            t = k / (NODES - 1)
            # A quadratic spline through thigh and shank, because cloth bends smoothly.
            if t < 0.5:
                a = 2 * t
                x = lateral * side * (1 - a) + knee_x * a
                y = (hips + 0.03) * (1 - a) + knee_y * a
            else:
                a = 2 * t - 1
                x = knee_x * (1 - a) + ankle_x * a
                y = knee_y * (1 - a) + (ankle_y - 0.008) * a
            bend = max(0.0, 1 - abs(t - 0.5) * 4)
            x += bend * 0.12 * ((lateral * side + ankle_x) / 2 - knee_x)
            slope = hip if t < 0.5 else lower
            width = (0.058 - 0.022 * t + 0.005 * np.sin(6.28 * t)) * bulk * loose
            if t == 0.0:
                width *= 0.8
            if t > 0.9:
                width *= 1.05
            parts[leg, k] = y, x, width / max(0.72, np.cos(slope * forward)), t
        pitch = lower * 0.55
        for k in range(NODES):
            t = k / (NODES - 1)
            y = ankle_y + 0.012 - t * (_ANKLE + 0.010)
            pitched = 1 - 0.45 * min(1.0, abs(pitch))
            length = 0.027 + 0.050 * np.sqrt(t) * abs(forward) * pitched
            shift = (0.010 + 0.034 * np.sqrt(t)) * forward * pitched
            parts[2 + leg, k] = y, ankle_x + shift + 0.03 * pitch * forward * t, length, t
    for arm in range(2):
        lateral = 0.118 * bulk if arm == 0 else -0.118 * bulk
        swing = -0.85 * stride * np.sin(2 * np.pi * (phase + 0.5 * arm)) * 0.48
        elbow = 0.22 + 0.25 * stride * max(0.0, np.sin(swing))
        shoulder_y = 0.812 + bob
        elbow_x = lateral * side * 1.08 + 0.165 * np.sin(swing) * forward
        elbow_y = shoulder_y - 0.165 * np.cos(swing)
        hand = swing + elbow
        hand_x = elbow_x + 0.205 * np.sin(hand) * forward
        hand_y = elbow_y - 0.205 * np.cos(hand)
        for k in range(NODES):
            t = k / (NODES - 1)
            if t < 0.45:
                a = t / 0.45
                x = lateral * side * (0.86 * (1 - a)) + elbow_x * a
                y = (shoulder_y + 0.004) * (1 - a) + elbow_y * a
            else:
                a = (t - 0.45) / 0.55
                x, y = elbow_x * (1 - a) + hand_x * a, elbow_y * (1 - a) + hand_y * a
            width = (0.041 - 0.016 * t) * sleeve
            if t > 0.8:
                width = 0.021 - 0.008 * max(0.0, t - 0.93) / 0.07
            if k < 2:
                width = (0.020 + 0.020 * k) * sleeve
            parts[4 + arm, k] = y, x, width, t
    heights = np.array([0.860, 0.846, 0.828, 0.790, 0.72, 0.64, 0.585, 0.53, hem])
    across = np.array([0.034, 0.066, 0.104, 0.118, 0.109, 0.100, 0.099, 0.106, 0.108])
    deep = np.array([0.034, 0.046, 0.060, 0.074, 0.076, 0.070, 0.070, 0.076, 0.074])
    for k in range(NODES):
        half = np.hypot(across[k] * side, deep[k] * forward) * bulk
        lean = 0.012 * forward * (heights[k] - hem) / 0.4
        parts[6, k] = heights[k] + bob, lean, half, (0.860 - heights[k]) / (0.860 - hem)
    heights = np.array([1.0, 0.992, 0.978, 0.955, 0.93, 0.905, 0.885, 0.868, 0.838])
    across = np.array([0.012, 0.030, 0.043, 0.049, 0.048, 0.043, 0.032, 0.030, 0.034])
    deep = np.array([0.014, 0.036, 0.052, 0.059, 0.058, 0.052, 0.036, 0.031, 0.034])
    for k in range(NODES):
        half = np.hypot(across[k] * side, deep[k] * forward)
        nod = (0.022 if k < 6 else 0.012) * forward
        parts[7, k] = heights[k] + bob, nod, half, (1.0 - heights[k]) / 0.162
    heights = np.linspace(0.83, 0.55, NODES)
    for k in range(NODES):
        t = k / (NODES - 1)
        round_off = np.sqrt(max(0.0, 1 - (2 * t - 1) ** 4))
        half = np.hypot(0.082 * side, 0.052 * forward) * (0.25 + 0.75 * round_off)
        parts[8, k] = heights[k] + bob, -0.105 * forward, half, t
    return parts


@njit(cache=True)
def place_parts(
    x: float,
    y: float,
    height: float,
    phase: float,
    stride: float,
    heading: float,
    build: Array,
    motion_x: float,
) -> NDArray[np.int64]:
    """Return the nodes of all parts in the image, shape (parts, nodes, 5); see `look.COLUMNS`.

    (`x`, `y`) is the ground point below the body's axis, `height` the height of the standing
    person, and `motion_x` the horizontal motion during the exposure [pixels]. Phase, stride and
    heading are as in `GaitPose`. `build` is breadth, width of the sleeves, hem of the upper
    garment, and width of the trousers.
    """
    forward, side = np.cos(heading), np.sin(heading)
    now = _skeleton(phase, stride, forward, side, build)
    step = _EXPOSURE * stride
    before = _skeleton(phase - step / 2, stride, forward, side, build)
    after = _skeleton(phase + step / 2, stride, forward, side, build)
    nodes = np.zeros((len(now), NODES, 5), np.int64)
    for p in range(len(now)):
        for k in range(NODES):
            moved = (after[p, k, 1] - before[p, k, 1]) * height + motion_x
            nodes[p, k, 0] = round((y - now[p, k, 0] * height) * 64)
            nodes[p, k, 1] = round((x + now[p, k, 1] * height) * 64)
            nodes[p, k, 2] = round(now[p, k, 2] * height * 64)
            nodes[p, k, 3] = 64 + round(abs(moved) * 64)
            nodes[p, k, 4] = round(now[p, k, 3] * 128 * 64)
        for k in range(1, NODES):  # Rows must increase.
            nodes[p, k, 0] = max(nodes[p, k, 0], nodes[p, k - 1, 0] + 1)
    return nodes


_SHADOW = 64  # half width of the contact shadow's sprite [pixels]


@dataclass(frozen=True)
class GaitPose:
    """Gait phase, stride and heading of a body."""

    phase: float  # gait cycles; one cycle is two steps
    stride: float  # relative step length in [0, 1]; 0 is standing
    heading: float  # 0 is to the right, π/2 towards the camera, -π/2 away from it [radians]


class Walker:
    """Clothed person; `seed` initialises folds, strands of hair and weave."""

    def __init__(self, look: WalkerLook, seed: int) -> None:
        self.look = look
        self._seed = seed
        sleeves = 1.0 if look.jacket is None else 1.12
        self._build = np.array([look.bulk, sleeves, look.hem, look.loose])
        coverage = superellipse(2 * _SHADOW // 3, 2 * _SHADOW, _SHADOW / 4, _SHADOW * 0.85, 2)[2]
        shade = Sprite(np.zeros((*coverage.shape, 3)), coverage)
        self._shadow = shade.shadow(0.42, _SHADOW // 8)

    def draw(
        self,
        canvas: NDArray[np.uint8],
        x: float,
        y: float,
        height: float,
        pose: GaitPose,
        gains: ArrayLike,
        motion: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Draw the person with a soft contact shadow over a canvas in place.

        (`x`, `y`) is the ground point below the body's axis, and `height` the height of the
        standing person [pixels]. The pose is that at the middle of the exposure; the limbs are
        blurred by their motion. `gains` is the light at evenly spaced heights from head to ground.
        `motion` is the motion of the whole person during the exposure, right and down [pixels]; its
        vertical part is too small to be visible and is ignored.
        """
        light = np.asarray(gains, np.float64)
        self._draw_shadow(canvas, x, y, height)
        rows = np.arange(len(canvas)) + 0.5
        place = np.clip((rows - (y - height)) / height, 0, 1) * (len(light) - 1)
        row_gains = np.round(np.interp(place, np.arange(len(light)), light) * 256)
        front = round((pose.heading - np.pi / 2) / (2 * np.pi) * AROUND)
        nodes = self._nodes(x, y, height, pose, motion[0])
        for part in self._order(pose):
            paint_part(canvas, nodes[part], self._textures[part], front, row_gains.astype(np.int64))

    def coverage(self, x: float, y: float, height: float, pose: GaitPose) -> Coverage:
        """Return the silhouette at mid-exposure; its window may lie outside the image."""
        nodes = self._nodes(x, y, height, pose, 0.0)[self._order(pose)]
        covered: Coverage = silhouette(nodes)
        return covered

    def _draw_shadow(self, canvas: NDArray[np.uint8], x: float, y: float, height: float) -> None:
        middle = np.array([[x, y - 0.012 * height]])
        self._shadow.draw(canvas, middle, 0.19 * height / _SHADOW)

    @cached_property
    def _textures(self) -> NDArray[np.uint8]:
        """Textures of the parts, which are not painted for silhouettes."""
        return wrap_textures(self.look, self._seed)

    def _nodes(
        self, x: float, y: float, height: float, pose: GaitPose, motion: float
    ) -> NDArray[np.int64]:
        placed: NDArray[np.int64] = place_parts(
            float(x),
            float(y),
            float(height),
            float(pose.phase),
            float(pose.stride),
            float(pose.heading),
            self._build,
            float(motion),
        )
        return placed

    def _order(self, pose: GaitPose) -> list[int]:
        """Return the parts from the farthest to the nearest."""
        near, far = ("right", "left") if np.cos(pose.heading) > 0 else ("left", "right")
        pack = [] if self.look.bag is None else ["pack"]
        on_his_back = ["torso", "head", *pack]
        trunk = on_his_back if np.sin(pose.heading) < -0.2 else [*pack, "torso", "head"]
        order = [f"{far} arm", f"{far} shoe", f"{far} leg", f"{near} shoe", f"{near} leg"]
        return [PARTS.index(name) for name in [*order, *trunk, f"{near} arm"]]
