"""The one exception for input that the user can correct, and the exit codes of the commands."""

EXIT_MISMATCH = 1
EXIT_BAD_INPUT = 2
EXIT_TOOL_FAILED = 3


class InputError(ValueError):
    """Input that cannot be used: what is wrong, where, and what was expected.

    The command line prints it as one line and exits with code 2.

    Parameters
    ----------
    what
        What is wrong.
    where
        The file, option or field that it concerns.
    expected
        What would be accepted.
    """

    def __init__(self, what: str, *, where: str, expected: str) -> None:
        self.what = what
        self.where = where
        self.expected = expected
        super().__init__(f"{where}: {what}; expected {expected}")
