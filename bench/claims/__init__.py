"""Claims of papers: their entries, their tests and their verdicts.

`claims_file.py` reads a paper's `claims.toml`. `claim_tests.py` judges a claim by the
test that it names. `row_verdicts.py` combines the verdicts in both settings.
"""
