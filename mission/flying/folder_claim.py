"""A flight's folder belongs to one flight at a time, whatever else is started on it."""

from __future__ import annotations

import contextlib
import contextvars
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from mission.findings import Finding, InputError

_HELD: contextvars.ContextVar[frozenset[Path]] = contextvars.ContextVar("claimed folders", default=frozenset())


@contextlib.contextmanager
def claimed(folder: Path, *, make: bool = False) -> Iterator[None]:
    """Hold a folder alone; the system lets go of it when this process ends, however it does.

    Who holds it already claims it again for nothing: before a long solve, and for the flight itself.

    Args:
        folder: Of the flight.
        make: Whether it is made where it is not there.

    Raises:
        InputError: A flight is under way in it, or it cannot be held.
    """
    held, place = _HELD.get(), folder.resolve()
    if place in held:
        yield
        return
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise _refused(folder, f"cannot be opened ({error.strerror}): give the folder of a flight") from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise _refused(
                folder, "a flight is under way in it: `mission push` to it, or end it (Ctrl-C where it runs) first"
            ) from error
        except OSError as error:
            raise _refused(
                folder, f"cannot be kept from other flights ({error.strerror}): give one on a disk of this computer"
            ) from error
        token = _HELD.set(held | {place})
        try:
            yield
        finally:
            _HELD.reset(token)
    finally:
        os.close(descriptor)


def _refused(folder: Path, advice: str) -> InputError:
    return InputError(str(folder), [Finding("folder", str(folder), advice)])
