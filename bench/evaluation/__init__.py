"""Trackers on frames, and what comes of it.

`loop.py` is the only loop over frames, `recorder.py` keeps what trackers say in it, `timing.py`
measures time in passes of its own, and `scoring.py` makes scores of a run's boxes.
"""
