"""Static criteria of scenes: measured on images and ground truth, before any tracker runs.

A criterion is a function of a `SceneImages` that returns one number. `criteria.toml` of a paper
names the function, its options, the target and the sentence of the paper that asks for it. The
functions of a paper stand in the module of its name here, those of several papers in `shared.py`.
"""
