"""What can go wrong with a simulated vehicle."""


class ScenarioError(ValueError):
    """A scenario breaks a rule; the message is one line: name, rule, what was found."""


class TransportError(Exception):
    """The link cannot be opened or has gone; the message is one line."""
