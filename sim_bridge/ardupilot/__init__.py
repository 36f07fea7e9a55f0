"""The built-in vehicle as ArduPilot Copter 4.5 behaves."""
