"""Exceptions of this package. Each has one sentence: what was expected, and what was found."""


class Error(ValueError):
    """An argument, a file or a state that cannot be used."""

    __module__ = "unic"


class FileError(Error, OSError):
    """A file that cannot be read or written. The sentence begins with its path.

    `errno` is the number of the operating system where it has refused an operation, else None.
    """

    __module__ = "unic"


class Fault(Error, RuntimeError):
    """A fault of the library itself. The animator of the call can no longer be used."""

    __module__ = "unic"
