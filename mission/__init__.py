"""What a person touches: the mission file, the command line, flights, and their records.

`load`, `plan` and `fly` do from Python what the command line does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mission.flying.flight import fly
    from mission.loading import load
    from mission.planning import plan

__all__ = ["fly", "load", "plan"]


def __getattr__(name: str) -> object:
    # Late, so that `mission --help` does not wait for jax and mavsdk.
    match name:
        case "fly":
            from mission.flying.flight import fly

            return fly
        case "load":
            from mission.loading import load

            return load
        case "plan":
            from mission.planning import plan

            return plan
        case _:
            raise AttributeError(f"module 'mission' has no attribute '{name}'")
