"""Claims of papers: what is claimed, how it is tested, and what was found.

`ledger.py` reads the entries, `kinds.py` has the kinds of test, `readings.py` the readings of a
text, and `sides.py` which runs a side of a comparison means. `judging.py` judges claims, each
test by `verdicts.py` and each check of a paper's own by `findings.py`; `conclusion.py` makes of a
claim's findings what is reported.
"""
