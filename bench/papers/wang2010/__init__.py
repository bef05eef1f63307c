"""CamShift improved by motion, inside a particle filter: its baselines, Table 1, Fig. 1 to 6."""
