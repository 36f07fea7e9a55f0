"""What a flight decides: events in, rows of one table, actions out; no clock, socket, file or thread in here."""
