"""Claims of papers: their entries, their tests and their verdicts.

`claims_file.py` reads a paper's `claims.toml`, `claim_tests.py` judges a claim by one of five kinds
of test, and `row_verdicts.py` has a claim's verdicts in both settings, with notes.
"""
