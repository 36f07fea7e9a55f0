"""A disk without room, as far as a process can make itself one."""

import contextlib
import resource


@contextlib.contextmanager
def no_file_larger_than(size):
    """What a full disk does to a file that grows: a short write, and then errors."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
