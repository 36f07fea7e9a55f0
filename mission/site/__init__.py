"""A mission as a problem: where it is, what is solid there, where the information lies, how long the battery lasts."""
