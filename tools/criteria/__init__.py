"""Criteria of scenes, measured on images and ground truth.

A criterion is a function of a `SceneImages` that returns one number. A paper's `criteria.toml`
names the function, its options, the required range and the sentence of the paper that requires it.
Each paper has a module of its name here; `shared.py` contains criteria of several papers.
"""
