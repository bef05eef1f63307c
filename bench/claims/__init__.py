"""Claims of papers: what is claimed, how it is tested, and what was found.

`ledger.py` reads the entries, `evaluation.py` turns scores into findings, `checks.py` does so for
claims that no score shows, and `conclusion.py` makes of a claim's findings what is reported.
"""
