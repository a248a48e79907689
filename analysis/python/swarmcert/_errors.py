"""Exceptions of the package."""

from typing import Any


class InputError(ValueError):
    """A file or an array that cannot be used.

    Attributes, each a string that is empty if it does not apply:
        file:  path as given, or the name of the array
        where: "line 7", "offset 132"
        field: tensor or key, such as "fc2.weight"
        value: the offending value
        what:  the rule that it breaks
        hint:  what to do about it
    """

    def __init__(
        self,
        message: str,
        file: str = "",
        where: str = "",
        field: str = "",
        value: str = "",
        what: str = "",
        hint: str = "",
    ) -> None:
        super().__init__(message)
        self.file = file
        self.where = where
        self.field = field
        self.value = value
        self.what = what
        self.hint = hint

    def __reduce__(self) -> Any:
        parts = (self.args[0], self.file, self.where, self.field, self.value, self.what, self.hint)
        return (InputError, parts)


class UsageError(ValueError):
    """Options that do not exist or make no sense together; exit code 2 of the command line."""
