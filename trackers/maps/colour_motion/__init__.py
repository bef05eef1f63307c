"""Colour and motion as one probability map (Wang & Tang 2010), and windows that drift on it."""
