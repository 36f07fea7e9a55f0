"""`python -m mission` is the `mission` command."""

from mission.cli import main

main()
