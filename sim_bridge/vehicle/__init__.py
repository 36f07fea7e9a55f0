"""What both built-in vehicles are made of: a body that moves, and the services every autopilot has."""
