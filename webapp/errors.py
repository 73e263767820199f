"""The web application's errors; the pages map them to HTTP, the command line to exit code 1."""


class WebappError(Exception):
    """Base of all errors that padlab's edge raises on purpose; the message is one sentence for the user."""


class ConfigError(WebappError):
    """A setting (environment variable, address, path) cannot be used."""


class DatabaseError(WebappError):
    """The database cannot be opened or does not have the expected schema."""


class NotFoundError(WebappError):
    """Something named by the user does not exist."""


class ConflictError(WebappError):
    """The request contradicts what is stored, for instance changing a study that has collected answers."""


class FarmError(WebappError):
    """Background work could not be done."""
