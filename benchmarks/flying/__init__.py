"""Flights as a user has them: whole processes, the built-in vehicle, and what the log says afterwards."""
