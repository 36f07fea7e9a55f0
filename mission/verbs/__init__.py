"""The verbs of the command line: thin functions, one a file, that call what does the work."""
