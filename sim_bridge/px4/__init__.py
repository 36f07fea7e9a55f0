"""The built-in vehicle as PX4 1.15 behaves."""
