"""What can go wrong on the host, named by what the caller can do about it."""


class HostError(Exception):
    """Base of the host's errors; the message is one line: name, value, rule, what to do."""


class ConfigError(HostError):
    """A vehicle or scenario file breaks a rule."""


class RecordingError(HostError):
    """A recording or model file cannot be used."""


class MissingExtra(HostError):
    """A bench-only dependency is not installed."""
