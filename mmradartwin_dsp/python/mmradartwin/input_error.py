"""The one error of files that are not what they should be."""


class InputError(ValueError):
    """Names file, key or line, value, and what is allowed; one line for the user."""
