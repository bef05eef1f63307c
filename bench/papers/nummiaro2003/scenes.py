"""Which claim asks what of which scene: all that is measured beside the tracker's runs."""

from bench.papers.nummiaro2003.appearance import (
    background,
    bins_and_noise,
    gains,
    kernels,
    occlusion,
    turned_and_scaled,
)
from bench.papers.nummiaro2003.mixture import one_of_two_colours
from bench.papers.nummiaro2003.particles import entrance, kick_offs, maximum, own_models
from bench.papers.scenes import SceneCheck

__all__ = ["CHECKS"]

PERSON, STUDENTS = "nummiaro2003/person", "nummiaro2003/students"
EVERY = (PERSON, "nummiaro2003/car", STUDENTS, "nummiaro2003/traffic", "nummiaro2003/head")

CHECKS = (
    SceneCheck(background, EVERY),
    SceneCheck(occlusion, (STUDENTS,)),
    SceneCheck(turned_and_scaled, EVERY),
    SceneCheck(kernels, EVERY),
    SceneCheck(maximum, (PERSON,)),
    SceneCheck(entrance, (PERSON,)),
    SceneCheck(kick_offs, (PERSON,), everything=True),
    SceneCheck(gains, EVERY, everything=True),
    SceneCheck(own_models, (STUDENTS,), everything=True),
    SceneCheck(bins_and_noise, (PERSON,), everything=True),
    SceneCheck(one_of_two_colours, EVERY, everything=True),
)
