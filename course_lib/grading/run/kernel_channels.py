"""What a kernel is started by and spoken to through: one command, and sockets that nothing inside can exchange."""

from __future__ import annotations

import contextlib
import os
import socket
import stat
from collections.abc import Sequence
from pathlib import Path

import ipykernel.kernelspec
import zmq
from jupyter_client.kernelspec import KernelSpec, KernelSpecManager

from .limits import Limits

__all__ = ["HeldSockets", "OneKernel", "limited_context"]

SOCKETS = 5
"""So many a kernel makes: z-1 to z-5, for requests, what is shown, typing, control and a heartbeat."""


class OneKernel(KernelSpecManager):
    """Knows the one command that starts our kernel, whatever name a notebook asks for."""

    def __init__(self, command: Sequence[str]) -> None:
        super().__init__()
        self.command = list(command)

    def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
        return KernelSpec(
            resource_dir=ipykernel.kernelspec.RESOURCES,
            argv=self.command,
            display_name="graded",
            language="python",
            interrupt_mode="signal",  # sent to the dead by `stop`; a message to them would be waited for
        )


def limited_context(limits: Limits) -> zmq.Context:
    """Sockets that take no message beyond the limit, never connect again, and give up a send that nobody takes."""
    context = zmq.Context()
    context.setsockopt(zmq.MAXMSGSIZE, int(limits.message_mb * 1e6))
    context.setsockopt(zmq.RECONNECT_IVL, -1)
    context.setsockopt(zmq.SNDTIMEO, int(limits.grace_seconds * 1000))
    context.setsockopt(zmq.LINGER, 0)
    return context


class HeldSockets:
    """The sockets of a kernel, held by descriptors; names in a closed folder, which nobody inside writes, lead there.

    What runs inside can put anything in the place of a socket, also a link to one outside, which is never followed.

    Parameters
    ----------
    closed : the folder for the names.
    """

    def __init__(self, closed: Path) -> None:
        self.closed = closed
        self.folder = -1
        self._held: list[int] = []

    def hold(self, place: str) -> bool:
        """Hold the sockets of a folder, before any code of a learner runs; whether all of them are there and listen."""
        with contextlib.suppress(OSError):
            self.folder = os.open(place, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            self._held.append(self.folder)
            for number in range(1, SOCKETS + 1):
                self._hold_one(f"z-{number}")
            return True
        self.release()
        return False

    def _hold_one(self, name: str) -> None:
        held = os.open(name, os.O_PATH | os.O_NOFOLLOW, dir_fd=self.folder)
        self._held.append(held)
        if not stat.S_ISSOCK(os.fstat(held).st_mode):
            raise OSError(f"{name} is no socket")
        place = self.closed / name
        place.unlink(missing_ok=True)
        place.symlink_to(f"/proc/self/fd/{held}")
        with socket.socket(socket.AF_UNIX) as trial:
            trial.connect(str(place))

    def release(self) -> None:
        """Hold them no longer."""
        while self._held:
            os.close(self._held.pop())
