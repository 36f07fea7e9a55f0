"""What is wrong with an input, said so that a person can mend it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable


@dataclasses.dataclass(frozen=True)
class Finding:
    """One thing that is wrong.

    Attributes:
        path: Dotted path of the entry, e.g. `obstacle.2.radius_m`.
        got: What stands there, as written; empty where nothing does.
        advice: What is wrong with it and what to write.
    """

    path: str
    got: str
    advice: str

    def under(self, section: str) -> Finding:
        """The same finding, seen from the table that holds the section."""
        return dataclasses.replace(self, path=f"{section}.{self.path}" if self.path else section)

    def __str__(self) -> str:
        return f"{self.path}: {f'got {self.got}; ' if self.got else ''}{self.advice}"


class InputError(ValueError):
    """An input that cannot be used, with everything that is wrong with it.

    Attributes:
        source: The file, as the user named it.
        findings: At least one.
    """

    def __init__(self, source: str, findings: Iterable[Finding]) -> None:
        self.source = source
        self.findings = tuple(findings)
        super().__init__("\n".join([f"{source}: {len(self.findings)} to mend", *map(str, self.findings)]))
