"""Stein variational ergodic search: sets of different, proven exploration trajectories.

Pure: local ENU metres and seconds in and out; no files, clocks, sockets, prints or global flags.
"""
