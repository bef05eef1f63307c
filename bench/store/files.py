"""Exception class of the store."""


class ResultsError(ValueError):
    """Error in reading or writing results; the message names the folder or file."""
