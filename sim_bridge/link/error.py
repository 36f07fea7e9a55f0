"""The one way a conversation with a vehicle fails."""


class LinkError(RuntimeError):
    """The vehicle could not be reached, or did not answer; the text says what was tried."""
