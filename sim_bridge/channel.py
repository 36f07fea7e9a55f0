"""A bad line, made on purpose: datagrams lost, doubled, delayed, and so out of order."""

from __future__ import annotations

import dataclasses
import heapq
import itertools
import random


@dataclasses.dataclass(frozen=True)
class Quality:
    """How bad a line is.

    Attributes:
        loss: Share of datagrams that never arrive.
        duplication: Share that arrive twice.
        delay_s: Mean delay.
        jitter_s: Delays are spread evenly by so much to either side.

    Raises:
        ValueError: A share outside [0, 1] or a negative time.
    """

    loss: float = 0.0
    duplication: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.loss <= 1.0 and 0.0 <= self.duplication <= 1.0):
            raise ValueError(f"loss and duplication are shares from 0 to 1, got {self.loss} and {self.duplication}")
        if self.delay_s < 0.0 or self.jitter_s < 0.0:
            raise ValueError(f"delay and jitter cannot be negative, got {self.delay_s} s and {self.jitter_s} s")


class Channel:
    """One direction of a line; knows no clock.

    Args:
        quality: How bad it is.
        seed: Of every choice.
    """

    def __init__(self, quality: Quality, seed: int = 0) -> None:
        self._quality = quality
        self._random = random.Random(seed)
        self._under_way: list[tuple[float, int, bytes]] = []
        self._order = itertools.count()

    def put(self, datagram: bytes, now_s: float) -> None:
        """Hand a datagram over."""
        quality = self._quality
        if self._random.random() < quality.loss:
            return
        copies = 2 if self._random.random() < quality.duplication else 1
        for _ in range(copies):
            delay_s = quality.delay_s + quality.jitter_s * self._random.uniform(-1.0, 1.0)
            heapq.heappush(self._under_way, (now_s + max(0.0, delay_s), next(self._order), datagram))

    def arrived(self, now_s: float) -> list[bytes]:
        """What has come out by now, in the order it did."""
        found = []
        while self._under_way and self._under_way[0][0] <= now_s:
            found.append(heapq.heappop(self._under_way)[2])
        return found
