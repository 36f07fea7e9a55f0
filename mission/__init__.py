"""What a person touches: the mission file, the command line, flights, and their records."""
