"""People in front of a parking place and on a campus: the target arrives, is occluded, leaves."""
