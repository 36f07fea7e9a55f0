"""Benchmarks: each a module to run, compared with an honest baseline in the same run."""
