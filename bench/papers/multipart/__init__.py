"""The adaptive single-/multi-part colour-histogram particle filter: Table 1, Fig. 3 and 4."""
