"""What holds for all tests."""

import ctypes
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import jax
import pytest

# No deadlines, as nothing here is about time, and the same examples everywhere, so that a failure can be had again.
hypothesis.settings.register_profile("everywhere", deadline=None, derandomize=True)
hypothesis.settings.load_profile("everywhere")

MOST_RESIDENT_BYTES = 2 << 30
PAGE_BYTES = 4096


@pytest.fixture(autouse=True, scope="module")
def compiled_code_is_let_go() -> Iterator[None]:
    """Forgets what was compiled once a process has become large: what hundreds of tests compile adds up."""
    yield
    pages = Path("/proc/self/statm")
    if pages.exists() and int(pages.read_text().split()[1]) * PAGE_BYTES > MOST_RESIDENT_BYTES:
        jax.clear_caches()
        # The C library keeps what was freed until it is asked.
        if hasattr(library := ctypes.CDLL(None), "malloc_trim"):
            library.malloc_trim(0)
