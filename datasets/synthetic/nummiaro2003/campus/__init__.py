"""People before a parking place and on a campus: the target comes, is hidden, and goes."""
