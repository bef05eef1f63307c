"""Statistics: intervals over cells, and the rules by which a claim is judged."""
