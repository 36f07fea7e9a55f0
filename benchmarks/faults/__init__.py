"""The fault matrix: every fault in every phase of a flight, on both autopilots, in virtual time."""
