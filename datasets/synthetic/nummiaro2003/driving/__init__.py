"""Cars that drive on roads, seen by a camera on a mast or in another car."""
