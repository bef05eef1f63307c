"""Pages that hold all they show: tables, charts and a player of frames, in one file."""
