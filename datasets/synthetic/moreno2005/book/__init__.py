"""A book before desk and shelf that bends, while the light turns from natural to yellow."""
