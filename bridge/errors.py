"""What can go wrong at the edge, named by what the caller can do about it."""


class BridgeError(Exception):
    """Base of all errors of the bridge; the message is one line: name, value, rule, what to do."""


class LinkError(BridgeError):
    """The link cannot be opened: unknown scheme, no such device, port in use, no kernel support."""


class LinkClosed(BridgeError):
    """The link has ended (end of log, device unplugged, peer gone) and yields nothing more."""


class LogFormatError(BridgeError):
    """The file is not what its name says, or holds nothing usable."""
