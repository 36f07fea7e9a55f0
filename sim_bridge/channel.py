"""A bad line, made on purpose: datagrams lost, doubled, delayed, and so out of order."""

from __future__ import annotations

import dataclasses
import heapq
import itertools
import random

HELD_BACK_S = 0.15
"""How long a datagram waits that is to be overtaken."""


@dataclasses.dataclass(frozen=True)
class Quality:
    """How bad a line is.

    Attributes:
        loss: Share of datagrams that never arrive.
        duplication: Share that arrive twice.
        delay_s: Mean delay.
        jitter_s: Delays are spread evenly by so much to either side.
        reordering: Share that is held back, so that later ones overtake it.

    Raises:
        ValueError: A share outside [0, 1] or a negative time.
    """

    loss: float = 0.0
    duplication: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    reordering: float = 0.0

    def __post_init__(self) -> None:
        shares = {"loss": self.loss, "duplication": self.duplication, "reordering": self.reordering}
        for name, share in shares.items():
            if not 0.0 <= share <= 1.0:
                raise ValueError(f"{name} is a share from 0 to 1, got {share}")
        if self.delay_s < 0.0 or self.jitter_s < 0.0:
            raise ValueError(f"delay and jitter cannot be negative, got {self.delay_s} s and {self.jitter_s} s")


class Channel:
    """One direction of a line; knows no clock.

    Args:
        quality: How bad it is.
        seed: Of every choice.
    """

    def __init__(self, quality: Quality, seed: int = 0) -> None:
        self.quality = quality
        self.cut = False
        """Whether nothing passes."""
        self._random = random.Random(seed)
        self._under_way: list[tuple[float, int, bytes]] = []
        self._order = itertools.count()

    def put(self, datagram: bytes, now_s: float) -> None:
        """Hand a datagram over."""
        quality, chance = self.quality, self._random
        if self.cut or chance.random() < quality.loss:
            return
        copies = 2 if chance.random() < quality.duplication else 1
        for _ in range(copies):
            delay_s = quality.delay_s + quality.jitter_s * chance.uniform(-1.0, 1.0)
            if quality.reordering > 0.0 and chance.random() < quality.reordering:
                delay_s += HELD_BACK_S
            heapq.heappush(self._under_way, (now_s + max(0.0, delay_s), next(self._order), datagram))

    def arrived(self, now_s: float) -> list[bytes]:
        """What has come out by now, in the order it did."""
        found = []
        while self._under_way and self._under_way[0][0] <= now_s:
            found.append(heapq.heappop(self._under_way)[2])
        return found
