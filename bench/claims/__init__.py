"""Claims of papers, their tests and their verdicts.

`ledger.py` reads the entries, `kinds.py` has the kinds of test, `readings.py` the readings of a
text, and `sides.py` selects the runs of a side of a comparison. `judging.py` judges claims, each
test by `verdicts.py` and each check of a paper by `findings.py`; `failures.py` gives failed runs
the worst score; `conclusion.py` makes the reported result from a claim's findings.
"""
