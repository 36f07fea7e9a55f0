"""The mission file: a TOML file that says what to explore, with what, and how.

A file a section; `Mission` is the whole, in local ENU metres and seconds (`mission.loading` reads one from disk).
"""

from mission.mission_file.mission import Mission

__all__ = ["Mission"]
