"""Information from outside, into a flight that is under way: files in a folder, checked like a mission file.

A push is one JSON object with any of: `obstacle` and `no_fly` (as in the mission file; added to what is there),
`information` (as in the mission file) with an optional `share` (how much of it against what is known, default 1:
replaces it), and `command` ("pause", "resume", "return", "land"). Who pushes writes `inbox/NAME.json`; the flight takes
it by renaming it to `inbox/NAME.taken`, before which it can be withdrawn, and answers with `inbox/NAME.answer`.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, Strict, TypeAdapter, ValidationError

from mission.findings import Finding, InputError
from mission.flying.log_writer import write_durably
from mission.mission_file import Mission
from mission.mission_file.errors import findings_from
from mission.mission_file.information import Information
from mission.mission_file.obstacle import NoFly, Obstacle
from mission.mission_file.values import Context, Section
from mission.site.information import density_of
from mission.site.problem import for_search
from mission.site.reachable import reachable, spare_in
from mission.site.solids import obstacle_field_of, solids_of
from planner.information import DensityGrid
from planner.problem import Problem

INBOX = "inbox"
PUSHED_SUFFIX = ".json"
TAKEN_SUFFIX = ".taken"
ANSWER_SUFFIX = ".answer"
_LOOKED_AT_S = 30.0
LARGEST_BYTES = 4_000_000
"""A push is data for one mission; more than this is a mistake."""


class Push(Section):
    """What can be pushed."""

    obstacle: Annotated[tuple[Obstacle, ...], Strict(False)] = ()
    """New obstacles."""
    no_fly: Annotated[tuple[NoFly, ...], Strict(False)] = ()
    """New volumes not to enter."""
    information: Information | None = None
    """New information."""
    share: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    """Its share; the rest is what was known before."""
    command: Literal["pause", "resume", "return", "land"] | None = None
    """What the operator wants."""

    def findings(self) -> Iterator[Finding]:
        """Something to push."""
        if not (self.obstacle or self.no_fly or self.information or self.command):
            yield Finding("file", "", "holds nothing: give obstacle, no_fly, information or command")
        for name in ("obstacle", "no_fly"):
            for index, entry in enumerate(getattr(self, name)):
                yield from (finding.under(f"{name}.{index}") for finding in entry.findings())
        if self.information is not None:
            yield from (finding.under("information") for finding in self.information.findings())


def read_push(source: str, text: str, mission: Mission, folder: Path) -> Push:
    """Read a push.

    Args:
        source: What it is called.
        text: Its content.
        mission: The mission it is for: its origin places geodetic positions.
        folder: What file names in it are relative to.

    Raises:
        InputError: Everything that is wrong with it.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        # Not only its decoding: a number of thousands of digits is a plain ValueError.
        raise InputError(source, [Finding("file", source, f"is not valid JSON: {error}")]) from error
    if not isinstance(data, dict):
        raise InputError(source, [Finding("file", type(data).__name__, 'must be an object: {"obstacle": [ … ]}')])
    context = Context(folder, mission.site.origin.point())
    try:
        push = TypeAdapter(Push).validate_python(data, context=context)
    except ValidationError as error:
        raise InputError(source, findings_from("", error.errors(include_url=False), Push)) from error
    if found := list(push.findings()):
        raise InputError(source, found)
    if push.information is not None:
        try:
            density_of(push.information, mission.site)
        except ValueError as error:
            raise InputError(source, [Finding("information", "", str(error))]) from error
    return push


def solids_in_push(push: Push, mission: Mission) -> int:
    """How many shapes a push holds.

    Raises:
        ValueError: A file in it cannot be used.
    """
    return sum(len(solids_of(entry, mission)) for entry in (*push.obstacle, *push.no_fly))


def with_push(mission: Mission, problem: Problem, push: Push) -> tuple[Mission, Problem]:
    """What is known once a push is taken in; obstacles are, whether or not they leave anything to explore.

    Args:
        mission: What was asked, with what was pushed before.
        problem: The same for the planner.
        push: What is new.

    Raises:
        ValueError: A file in it cannot be used, or it brings information that cannot be reached.
    """
    obstacles, search = problem.obstacles, problem.search
    information = problem.information if search is None else search.prior
    if push.obstacle or push.no_fly:
        mission = mission.model_copy(
            update={"obstacle": (*mission.obstacle, *push.obstacle), "no_fly": (*mission.no_fly, *push.no_fly)}
        )
        obstacles = obstacle_field_of(mission)
    if push.information is not None:
        information = mixed(information, density_of(push.information, mission.site), push.share)
    try:
        information = reachable(information, spare_in(mission.site, obstacles, mission.keep_out_m))
    except ValueError:
        if push.information is not None:
            raise
    if search is not None:
        # A search looks where it has not looked yet: replans work that out from what was flown.
        search = dataclasses.replace(search, prior=for_search(information, search.detection_radius_m))
        information = search.effort(problem.reach_m)
    return mission, dataclasses.replace(problem, obstacles=obstacles, information=information, search=search)


def mixed(known: DensityGrid, new: DensityGrid, share: float) -> DensityGrid:
    """What is known, with a share of something new, on cells as fine as the finer of the two along each axis."""
    if share >= 1.0:
        return new
    first, second = known.mass.shape, new.mass.shape
    shape = (max(first[0], second[0]), max(first[1], second[1]), max(first[2], second[2]))
    return DensityGrid(known.workspace, (1.0 - share) * _on_cells(known, shape) + share * _on_cells(new, shape))


def _on_cells(grid: DensityGrid, shape: tuple[int, int, int]) -> Float[np.ndarray, "nx ny nz"]:
    """The mass of a grid on cells of another size, by the cell that each new one's centre lies in."""
    mass = grid.mass
    for axis, count in enumerate(shape):
        owner = ((np.arange(count) + 0.5) / count * mass.shape[axis]).astype(int)
        mass = np.take(mass, owner, axis=axis)
    return mass / mass.sum()


@dataclasses.dataclass(frozen=True)
class Arrived:
    """A file that was pushed.

    Attributes:
        name: What it is called.
        push: What is in it; None: it was refused.
        reason: Why it was refused.
    """

    name: str
    push: Push | None
    reason: str = ""


class Intake:
    """The inbox of a flight.

    What lies there from before the flight began is taken in as far as it is knowledge; what somebody wanted of an
    earlier flight is not done in this one.

    Args:
        folder: The flight's folder.
        mission: The mission pushes are for.
    """

    def __init__(self, folder: Path, mission: Mission) -> None:
        self._inbox = folder / INBOX
        self._inbox.mkdir(parents=True, exist_ok=True)
        self._mission = mission
        # What was answered before (by a flight that is now resumed) is not taken again.
        self._seen = {path.stem for path in self._inbox.glob(f"*{ANSWER_SUFFIX}")}
        self._before = {path.stem for path in self._waiting()}

    def _waiting(self) -> list[Path]:
        """What is not answered, in the order of the names: pushed, or taken by a flight that ended over it."""
        paths = [*self._inbox.glob(f"*{PUSHED_SUFFIX}"), *self._inbox.glob(f"*{TAKEN_SUFFIX}")]
        return sorted((path for path in paths if path.stem not in self._seen), key=lambda path: path.stem)

    def arrived(self) -> list[Arrived]:
        """What came since the last call, in the order of the names."""
        return [arrived for path in self._waiting() if (arrived := self._take(path)) is not None]

    def _take(self, path: Path) -> Arrived | None:
        """Take a file, so that who pushed it cannot withdraw it any more; None: it was withdrawn."""
        taken = path.with_suffix(TAKEN_SUFFIX)
        try:
            path.replace(taken)
        except FileNotFoundError:
            return None
        except OSError:
            # Where names cannot be changed it is read where it lies.
            taken = path
        self._seen.add(path.stem)
        try:
            if taken.stat().st_size > LARGEST_BYTES:
                raise InputError(path.name, [Finding("file", path.name, f"is larger than {LARGEST_BYTES} bytes")])
            push = read_push(path.name, taken.read_text(encoding="utf-8"), self._mission, self._inbox)
        except (OSError, UnicodeDecodeError) as error:
            return Arrived(path.stem, None, f"{path.name} cannot be read: {error}")
        except InputError as error:
            return Arrived(path.stem, None, "; ".join(map(str, error.findings)))
        if push.command is None or path.stem not in self._before:
            return Arrived(path.stem, push)
        known = push.model_copy(update={"command": None})
        if not any(True for _ in known.findings()):
            return Arrived(path.stem, known)
        return Arrived(path.stem, None, f'"{push.command}" was meant for an earlier flight: push it again')

    def answer(self, arrived: Arrived, accepted: bool, reason: str) -> None:
        """Tell who pushed what became of it; on a full disk nobody is told, and the flight goes on."""
        text = json.dumps({"accepted": accepted, "reason": reason})
        with contextlib.suppress(OSError):
            write_durably(self._inbox / f"{arrived.name}{ANSWER_SUFFIX}", text)


def push_into(folder: Path, file: Path, timeout_s: float = 10.0) -> dict[str, Any] | None:
    """Give a file to the flight in a folder, and wait for its answer.

    Args:
        folder: The flight's folder.
        file: What to push.
        timeout_s: How long to wait.

    Returns:
        The answer: `accepted` and `reason`; None: nobody took it, and it is withdrawn.

    Raises:
        InputError: The folder has no inbox, so no flight writes there.
        OSError: The file cannot be read.
    """
    inbox = folder / INBOX
    if not inbox.is_dir():
        raise InputError(str(folder), [Finding(INBOX, "", "is missing: give the folder of a flight under way")])
    pushed = inbox / f"{time.time_ns()}-{file.stem}{PUSHED_SUFFIX}"
    write_durably(pushed, file.read_text(encoding="utf-8"))
    if (answer := _answer_to(pushed, timeout_s)) is not None:
        return answer
    try:
        pushed.unlink()
    except FileNotFoundError:
        # A flight has just taken it, and answers when it has looked at it.
        unanswered = {"accepted": False, "reason": "a flight took it and has not answered: look at what it does"}
        return _answer_to(pushed, _LOOKED_AT_S) or unanswered
    return None


def _answer_to(pushed: Path, timeout_s: float) -> dict[str, Any] | None:
    answer = pushed.with_suffix(ANSWER_SUFFIX)
    until_s = time.monotonic() + timeout_s
    while time.monotonic() < until_s:
        if answer.exists():
            return json.loads(answer.read_text(encoding="utf-8"))
        time.sleep(0.05)
    return None
