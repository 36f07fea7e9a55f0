"""A log on the disk, written on a thread of its own: a disk that is slow, full or gone stalls nobody who writes to it.

What is written waits in a queue, bounded so that a disk which hangs does not fill the memory. The file is put on the
disk once a second, in between it is the system's: a kill loses what waits in the queue, a power cut the last second.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import errno
import os
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path

_MOST_WAITING = 20_000
_SYNC_HOST_S = 1.0
_CLOSE_HOST_S = 10.0

Job = Callable[[], None]


class LogWriter:
    """Appends lines to one file, and does other work on the disk in the same order.

    Args:
        path: The file.
        first: Its first line, or the first of what goes on behind an earlier log.
        goes_on: Whether an earlier log is gone on with; otherwise there must be none.

    Attributes:
        lost_lines: Lines that were not written.
        fault: Why the last one was not; None: it was.

    Raises:
        OSError: The file cannot be begun.
    """

    def __init__(self, path: Path, first: bytes, *, goes_on: bool) -> None:
        torn = goes_on and _is_torn(path)
        # Unbuffered: a line is with the system when `write` returns, and what was not written is known.
        self._file = path.open("ab" if goes_on else "xb", buffering=0)
        self._torn = b""
        self._lost = threading.Lock()
        self.lost_lines = 0
        self.fault: OSError | None = None
        self._append((b"\n" if torn else b"") + first)
        if self.fault is not None:
            self._file.close()
            raise self.fault
        sync_folder(path.parent)
        self._synced_s = time.monotonic()
        self._closed = False
        self._jobs: queue.Queue[Job | None] = queue.Queue(_MOST_WAITING)
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    def append(self, line: bytes) -> None:
        """Write a line, soon; where there is no room to wait it is lost, and counted."""
        if not self._closed and not self._give(lambda: self._append(line)):
            self._lose(OSError(errno.EBUSY, "the disk does not keep up"))

    def do(self, job: Callable[[], None]) -> concurrent.futures.Future[None]:
        """Have something done on the disk behind everything written so far; the answer is its result or its error."""
        future: concurrent.futures.Future[None] = concurrent.futures.Future()

        def run() -> None:
            try:
                job()
            except (OSError, ValueError) as error:
                future.set_exception(error)
            else:
                future.set_result(None)

        if self._closed or not self._give(run):
            future.set_exception(OSError(errno.EBUSY, "the disk does not keep up"))
        return future

    def close(self) -> None:
        """Write what waits, and end; a disk that hangs is not waited for much longer."""
        if self._closed:
            return
        self._closed = True
        with contextlib.suppress(queue.Full):
            self._jobs.put(None, timeout=_CLOSE_HOST_S)
        self._thread.join(_CLOSE_HOST_S)

    def _give(self, job: Job) -> bool:
        try:
            self._jobs.put_nowait(job)
        except queue.Full:
            return False
        return True

    def _run(self) -> None:
        while True:
            try:
                job = self._jobs.get(timeout=_SYNC_HOST_S)
            except queue.Empty:
                job = self._sync
            if job is None:
                break
            job()
            if time.monotonic() - self._synced_s >= _SYNC_HOST_S:
                self._sync()
        self._sync()
        self._file.close()

    def _append(self, line: bytes) -> None:
        data = self._torn + line
        try:
            written = self._file.write(data)
        except OSError as error:
            self._lose(error)
            return
        # A line that was cut short goes on where it was cut, or everything behind it could not be read.
        self._torn = data[written:]
        if not self._torn:
            self.fault = None

    def _sync(self) -> None:
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            self.fault = error
        self._synced_s = time.monotonic()

    def _lose(self, error: OSError) -> None:
        with self._lost:
            self.lost_lines += 1
            self.fault = error


def write_durably(path: Path, text: str) -> None:
    """Write a file so that it is either whole or not there, also after a power cut.

    Raises:
        OSError: It is not there.
    """
    partial = path.with_name(path.name + ".partial")
    with partial.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Put the names in a folder on the disk: without that a power cut takes a whole new file.

    Raises:
        OSError: They are not there.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some filesystems cannot do that, and have nothing to do.
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(descriptor)


def _is_torn(path: Path) -> bool:
    """Whether a file ends in the middle of a line."""
    if not path.exists() or not path.stat().st_size:
        return False
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) != b"\n"
