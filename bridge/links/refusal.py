"""Why a medium cannot be opened, in words that say what to do."""

import errno
import os
import socket

_ADVICE = {
    errno.EADDRINUSE: "another program is using the port, see `ss -lnup`",
    errno.EADDRNOTAVAIL: "HOST must be an address of this machine, 0.0.0.0 for all of them",
    errno.ECONNREFUSED: "is the server running?",
    errno.ENETUNREACH: "check the network, see `ip route`",
    errno.EHOSTUNREACH: "check that the other machine is on the network",
    errno.ETIMEDOUT: "check that the other machine is on the network",
    errno.ENOENT: "plug the device in; `mils doctor` lists those that are there",
    errno.EBUSY: "another program is using it",
}


def refusal(error: Exception, advice: dict[int, str] | None = None) -> str:
    """The system's word for the error, and what to do; `advice` by errno goes before the common one."""
    number = getattr(error, "errno", None)
    if isinstance(error, socket.gaierror):
        return f"{error.strerror}; check HOST, or give it as numbers"
    if isinstance(error, TimeoutError):
        number = errno.ETIMEDOUT
    if not isinstance(number, int):
        return str(error)
    what_to_do = {**_ADVICE, **(advice or {})}.get(number)
    return os.strerror(number) + (f"; {what_to_do}" if what_to_do else "")
