"""A street seen by a camera: sky, facades, ground, things that stand about, and the light."""
