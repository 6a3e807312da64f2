"""Defines the exceptions of the module. All of them are `ValueError`s, and their messages say what to do."""

from __future__ import annotations


class PartprobeError(ValueError):
    """The base of all exceptions of this package."""


class UsageError(PartprobeError):
    """The call is wrong: an unknown label source, a setting out of range, or an array of a different length."""


class StepError(PartprobeError):
    """A STEP file, a mesh or a point cloud cannot be labeled."""

    file: str | None
    """The file, or `None` if bytes were given."""
    entity: int | None
    """The `#` number of the first entity that was lost, or `None` if no entity is the reason."""
    status: str
    """`over-budget` if larger limits could help, otherwise `failed`."""

    def __init__(self, reason: str, file: str | None = None, entity: int | None = None, status: str = "failed") -> None:
        super().__init__(reason, file, entity, status)
        self.reason = reason
        self.file = file
        self.entity = entity
        self.status = status

    def __str__(self) -> str:
        return self.reason if self.file is None else f"{self.file}: {self.reason}"


class DamagedFileError(PartprobeError):
    """A carrier, a data set or a file of weights is damaged, or was changed after it was written."""

    file: str
    """The file."""

    def __init__(self, reason: str, file: str) -> None:
        super().__init__(reason, file)
        self.reason = reason
        self.file = file

    def __str__(self) -> str:
        return f"{self.file}: {self.reason}"
