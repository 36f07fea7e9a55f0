"""A flight: what has threads, processes and files around the executive, until it is put down safely."""
