"""Functions of `import trackmark`: run trackers on sequences, and read and compare results."""
