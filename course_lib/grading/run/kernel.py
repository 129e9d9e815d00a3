"""One kernel for one notebook: started inside the sandbox, watched from outside, spoken to over local sockets.

It has the methods that nbval calls. Whatever comes from it is counted before it is read, and may be anything.
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from queue import Empty
from typing import Any

import ipykernel.kernelspec
import psutil
import zmq
from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
from jupyter_client.manager import KernelManager
from nbval.kernel import RunningKernel

from course_lib.grading.run.inside.course_probe import MIME
from course_lib.grading.run.kernel_messages import Strike, check_message
from course_lib.grading.run.watchdog import watch

from .kernel_imports import Room
from .limits import Limits
from .sandbox import Held, bwrap_command, interpreter, open_command

__all__ = ["Kernel", "Strike"]


class _OneKernel(KernelSpecManager):
    """Knows the one command that starts our kernel, whatever name a notebook asks for."""

    command: tuple[str, ...] = ()
    variables: dict[str, str] = {}

    def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
        return KernelSpec(
            resource_dir=ipykernel.kernelspec.RESOURCES,
            argv=list(self.command),
            env=self.variables,
            display_name="graded",
            language="python",
            interrupt_mode="signal",  # sent to the dead by `stop`; a message to them would be waited for
        )


class Kernel(RunningKernel):
    """A running kernel.

    Parameters
    ----------
    folder : a private, short, absolute path; sockets live below it.
    note_answer : called with each answer that the kernel publishes; gives what is to be returned by `ask`.
    seconds : what is left of `limits.total_seconds` for this submission.
    """

    def __init__(
        self,
        held: Held,
        room: Room,
        limits: Limits,
        folder: Path,
        note_answer: Callable[[Any], Any],
        seconds: float | None = None,
    ) -> None:
        self.limits = limits
        self._seconds = limits.total_seconds if seconds is None else seconds
        self._note_answer = note_answer
        self._ready: dict[str, deque[dict]] = {"iopub": deque(), "shell": deque()}
        self._struck: Strike | None = None
        self._shown = 0
        self._deadline = time.monotonic() + limits.start_seconds
        self._limit_name = "start_seconds"
        number = sum(1 for _ in folder.glob("k*"))
        self._closed, self._open = folder / f"k{number}", folder / f"s{number}"
        for place in (self._closed, self._open):
            place.mkdir(mode=0o700)
        connection = self._closed / "c.json"
        program = ["/course/kernel_main.py", "/course/room.json", str(connection), held.kind]
        self._start(held, room, connection, program)
        self._began = time.monotonic()
        threading.Thread(target=watch, args=(self, self._began + self._seconds), daemon=True).start()
        try:
            self._ensure_iopub_up()
        except BaseException:
            self.stop()
            raise

    def _start(self, held: Held, room: Room, connection: Path, program: list[str]) -> None:
        specs = _OneKernel()
        if held.kind == "bwrap":
            words = [interpreter(), "-I", "-S", *program]
            specs.command = tuple(bwrap_command(held, room, self.limits, words, (self._closed, self._open)))
            environment = {"PATH": "/usr/bin:/bin"}
        else:
            settings = room.folder / "room.json"
            words, environment = open_command(room, self._open)
            specs.command = (*words, str(room.folder / "kernel_main.py"), str(settings), str(connection), held.kind)
        self.context = zmq.Context()
        self.context.setsockopt(zmq.MAXMSGSIZE, int(self.limits.message_mb * 1e6))
        self.context.setsockopt(zmq.RECONNECT_IVL, -1)
        self.context.setsockopt(zmq.LINGER, 0)
        self.km = KernelManager(
            kernel_name="graded",
            kernel_spec_manager=specs,
            connection_file=str(connection),
            transport="ipc",
            ip=str(self._open / "z"),
            context=self.context,
        )
        log = open(self._closed / "said.txt", "wb")
        with log:
            self.km.start_kernel(env=environment, cwd=str(self._closed), stdout=log, stderr=subprocess.STDOUT)
        self.process = psutil.Process(self.km.provisioner.pid)
        deadline = time.monotonic() + self.limits.start_seconds
        while self._sockets(held.kind) < 5:
            if not self.alive() or time.monotonic() > deadline:
                tail = (self._closed / "said.txt").read_text(errors="replace")[-400:]
                self.stop()
                raise RuntimeError(f"the kernel did not start: {tail.strip()}")
            time.sleep(0.01)
        self.kc = self.km.client()
        self.kc.ip = str(self._seen / "z")
        self.kc.start_channels(stdin=False, hb=False, control=True)

    @property
    def watched(self) -> bool:
        """Whether there is still something to watch."""
        return self._struck is None and hasattr(self, "km")

    @property
    def sockets(self) -> Path:
        """The folder of its sockets, as seen from outside."""
        return self._seen

    def _sockets(self, kind: str) -> int:
        """How many there are; finds out where they are seen from outside: through a process of the sandbox."""
        if kind == "none":
            self._seen = self._open
            return sum(1 for _ in self._seen.iterdir())
        with contextlib.suppress(psutil.NoSuchProcess, OSError):
            for one in self.process.children(recursive=True):
                self._seen = Path(f"/proc/{one.pid}/root{self._open}")
                if (count := sum(1 for _ in self._seen.iterdir())) > 0:
                    return count
        return 0

    # what is asked of it

    @contextlib.contextmanager
    def limit(self, seconds: float, name: str) -> Iterator[None]:
        """Within this block, the kernel has so many seconds; `name` is told when they are over."""
        self._limit_name = name
        self._deadline = time.monotonic() + seconds
        yield

    def ask(self, source: str, given: Sequence[bytes]) -> list[Any]:
        """Run a probe with `given` beside it, and return what `note_answer` made of the answers that came."""
        content = {"code": source, "silent": False, "user_expressions": {}, "allow_stdin": False}
        request = self.kc.session.msg("execute_request", content)
        self.kc.session.send(self.kc.shell_channel.socket, request, buffers=list(given))
        message = request["header"]["msg_id"]
        answers: list[Any] = []
        self.await_reply(message)
        while True:
            try:
                said = self.get_message("iopub", timeout=2)
            except Empty:
                break
            if said["msg_type"] == "error" and said["parent_header"].get("msg_id") == message:
                text = f"{said['content'].get('ename')}: {said['content'].get('evalue')}"
                raise Strike("no function", f"Asking it failed with {text[:200]}.")
            if said["msg_type"] == "display_data" and MIME in said["content"].get("data", {}):
                answers.append(said["content"]["data"][MIME])
            if said["msg_type"] == "status" and said["parent_header"].get("msg_id") == message:
                if said["content"].get("execution_state") == "idle":
                    break
        return [self._note_answer(answer) for answer in answers]

    def alive(self) -> bool:
        """Whether the process runs and nothing struck it."""
        return self._struck is None and hasattr(self, "km") and bool(self.km.is_alive())

    def is_alive(self) -> bool:
        return self.alive()

    # what nbval calls

    def await_reply(self, msg_id: str, timeout: float | None = None) -> None:
        """Wait for the reply within the limit in force; after it, interrupt, and if that is ignored, kill."""
        interrupted = False
        while True:
            try:
                message = self.get_message("shell", timeout=max(0.0, self._deadline - time.monotonic()))
            except Empty:
                told = f"{self._limit_name} = {getattr(self.limits, self._limit_name):g}"
                sentence = f"Time was up ({told}): perhaps a loop that never ends."
                if interrupted:
                    self.strike("timeout", sentence + " It did not stop when interrupted, so its kernel was ended.")
                    raise self._struck from None
                interrupted = True
                self._deadline = time.monotonic() + self.limits.grace_seconds
                self.kc.control_channel.send(self.kc.session.msg("interrupt_request", {}))
                self._late = Strike("timeout", sentence)
                continue
            if message["parent_header"].get("msg_id") == msg_id:
                if interrupted:
                    raise self._late
                return

    def get_message(self, stream: str, timeout: float | None = None) -> dict:
        """The next message of a stream; meanwhile the other is read, so that nothing piles up unseen."""
        until = time.monotonic() + (timeout if timeout is not None else self.limits.total_seconds)
        sockets = {self.kc.iopub_channel.socket: "iopub", self.kc.shell_channel.socket: "shell"}
        poller = zmq.Poller()
        for socket in sockets:
            poller.register(socket, zmq.POLLIN)
        while True:
            if self._struck is not None:
                raise self._struck
            if self._ready[stream]:
                return self._ready[stream].popleft()
            left = until - time.monotonic()
            if left <= 0:
                raise Empty
            readable = poller.poll(min(left, 0.1) * 1000)
            for socket, _ in readable:
                self._read(sockets[socket], socket)
            if not readable and not self.km.is_alive():
                if self._struck is None:
                    self.strike("died", "The kernel ended while this task ran: something in it ended the program.")
                raise self._struck  # type: ignore[misc]

    def _read(self, stream: str, socket: Any) -> None:
        parts = socket.recv_multipart(zmq.NOBLOCK)
        size = sum(len(part) for part in parts)
        try:
            _, parts = self.kc.session.feed_identities(parts)
            message = self.kc.session.deserialize(parts)
            kind = message["msg_type"]
            check_message(kind, message["parent_header"], message["content"])
            answer = kind == "display_data" and MIME in message["content"]["data"]
        except Exception as error:  # whatever a hostile kernel sends, the words for it are the same
            self.strike("garbled", f"The kernel sent something that is no message ({type(error).__name__}).")
            return
        if answer:
            if size > self.limits.answer_mb * 1e6:
                told = f"answer_mb = {self.limits.answer_mb:g}"
                self.strike("oversized", f"The answer was larger than allowed ({told}).")
                return
        elif stream == "iopub" and kind != "status" and kind != "execute_input":
            self._shown += size
            if self._shown > self.limits.output_mb * 1e6:
                told = f"output_mb = {self.limits.output_mb:g}"
                self.strike("output", f"It printed more than allowed ({told}): perhaps a print in a loop.")
                return
        self._ready[stream].append(message)

    def strike(self, code: str, sentence: str) -> None:
        """End the kernel, with the reason that everybody who waits for it will see."""
        if self._struck is None:
            self._struck = Strike(code, sentence)
        self._kill()

    def age(self) -> float:
        """Seconds since it was ready for its first cell."""
        return time.monotonic() - self._began

    def _kill(self) -> None:
        with contextlib.suppress(psutil.NoSuchProcess):
            family = self.process.children(recursive=True)
            self.process.kill()
            for one in family:
                with contextlib.suppress(psutil.NoSuchProcess):
                    one.kill()

    def stop(self) -> None:
        """End the kernel, its processes and its sockets; safe to call twice."""
        if not hasattr(self, "km"):
            return
        if hasattr(self, "process"):
            self._kill()
            with contextlib.suppress(subprocess.TimeoutExpired):  # the manager looks only every tenth of a second
                self.km.provisioner.process.wait(1)
        if hasattr(self, "kc"):
            self.kc.stop_channels()
        self.km.shutdown_kernel(now=True)
        self.km.cleanup_resources()
        del self.km
        self.context.destroy(linger=0)
        for place in (self._closed, self._open):
            shutil.rmtree(place, ignore_errors=sys.platform != "linux")
