"""Evaluation of trackers on sequences.

`loop.py` is the only loop over frames, for every protocol and for timing runs. `recorder.py` calls
one tracker and stores its estimates, `run_context.py` keeps its random generators and working
directory, and `scoring.py` scores runs.
"""
