"""HTML pages in one file: tables, charts and a player of frames."""
