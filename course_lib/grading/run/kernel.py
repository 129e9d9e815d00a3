"""One kernel for one notebook: started inside the sandbox, watched from outside, spoken to over local sockets.

It has the methods that nbval calls. Whatever comes from it is counted before it is read, and may be anything.
"""

from __future__ import annotations

import contextlib
import math
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

import psutil
import zmq
from jupyter_client.manager import KernelManager
from nbval.kernel import RunningKernel

from course_lib.grading.run.inside.course_probe import MIME
from course_lib.grading.run.kernel_messages import Strike, check_message, is_answer, needed, weigh
from course_lib.grading.run.watchdog import watch

from .counting import Spent, new_group, spent
from .kernel_channels import HeldSockets, OneKernel, limited_context
from .kernel_imports import Room
from .limits import Limits
from .sandbox import Held, kernel_command

__all__ = ["Kernel", "Strike"]

MOST_WAITING = 10_000
"""So many messages may wait to be read."""


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
        self.seconds = limits.total_seconds if seconds is None else seconds
        self._note_answer = note_answer
        self._ready: dict[str, deque[dict]] = {"iopub": deque(), "shell": deque()}
        self._struck: Strike | None = None
        self._shown = self._answered = 0
        self.processor = 0.0
        self._closed, self._open = (folder / f"{letter}{len(list(folder.glob('k*')))}" for letter in "ks")
        for place in (self._closed, self._open):
            place.mkdir(mode=0o700)
        self._sockets = HeldSockets(self._closed)
        self.group = new_group(limits) if held.kind == "bwrap" else None
        self._limit, self._mark = "start_seconds", self.now()
        self._start(held, room)
        self._began = time.monotonic()
        threading.Thread(target=watch, args=(self,), daemon=True).start()
        try:
            self._ensure_iopub_up()
        except BaseException:
            self.stop()
            raise

    def _start(self, held: Held, room: Room) -> None:
        connection = self._closed / "c.json"
        words, environment = kernel_command(held, room, self.limits, self._closed, self._open)
        words = self.group.entered(words) if self.group else words
        self.context = limited_context(self.limits)
        self.km = KernelManager(
            kernel_name="graded",
            kernel_spec_manager=OneKernel(words),
            connection_file=str(connection),
            transport="ipc",
            ip=str(self._open / "z"),
            context=self.context,
        )
        with open(self._closed / "said.txt", "wb") as log:
            self.km.start_kernel(env=environment, cwd=str(self._closed), stdout=log, stderr=subprocess.STDOUT)
        self.process = psutil.Process(self.km.provisioner.pid)
        deadline = time.monotonic() + self.limits.start_seconds
        while not self.alive() or not self._held(held.kind):
            if not self.alive() or time.monotonic() > deadline:
                tail = (self._closed / "said.txt").read_text(errors="replace")[-400:]
                self.stop()
                raise RuntimeError(f"the kernel did not start: {tail.strip()}")
            time.sleep(0.01)
        self.kc = self.km.client(context=self.context)
        self.kc.ip = str(self._closed / "z")
        self.kc.start_channels(stdin=False, hb=False, control=True)
        channels = (self.kc.iopub_channel, self.kc.shell_channel)
        self._cut = [channel.socket.get_monitor_socket(zmq.EVENT_DISCONNECTED) for channel in channels]

    def _held(self, kind: str) -> bool:
        """Whether all of its sockets listen, and are held; they are found through a process of the sandbox."""
        inside = [f"/proc/{one.pid}/root" for one in self.process.children(recursive=True)]
        held = any(self._sockets.hold(f"{root}{self._open}") for root in (inside if kind == "bwrap" else [""]))
        self.sockets = self._sockets.folder
        return held

    @property
    def watched(self) -> bool:
        """Whether there is still something to watch."""
        return self._struck is None and hasattr(self, "km")

    def now(self) -> Spent:
        """The time that it has taken up to now."""
        return Spent(self.processor, time.monotonic())

    @contextlib.contextmanager
    def limit(self, name: str) -> Iterator[None]:
        """Within this block, the kernel has the seconds of this limit, which is told when they are over."""
        self._limit, self._mark = name, self.now()
        yield

    def _most(self) -> float:
        return getattr(self.limits, self._limit)

    def execute_cell_input(self, cell_input: str, allow_stdin: bool | None = None, given: Sequence[bytes] = ()) -> str:
        """Send a cell to be run, with what is `given` beside it; the id of the request."""
        content = {"code": cell_input, "silent": False, "store_history": False, "user_expressions": {}}
        content |= {"allow_stdin": False, "stop_on_error": False}
        request = self.kc.session.msg("execute_request", content)
        try:
            self.kc.session.send(self.kc.shell_channel.socket, request, buffers=list(given))
        except zmq.ZMQError:
            self.strike("died", "The kernel took no more requests: something in it closed its connection.")
            raise self._struck from None
        return request["header"]["msg_id"]

    def ask(self, source: str, given: Sequence[bytes]) -> list[Any]:
        """Run a probe with `given` beside it, and return what `note_answer` made of the answers that came."""
        self._answered = 0
        message = self.execute_cell_input(source, given=given)
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
            if said["msg_type"] == "display_data":
                answers.append(said["content"]["data"][MIME])
            if said["msg_type"] == "status" and said["parent_header"].get("msg_id") == message:
                break
        return [self._note_answer(answer) for answer in answers]

    def alive(self) -> bool:
        """Whether the process runs and nothing struck it."""
        return self._struck is None and hasattr(self, "km") and bool(self.km.is_alive())

    is_alive = alive

    def await_reply(self, msg_id: str, timeout: float | None = None) -> None:
        """Wait for the reply within the limit in force; after it, interrupt, and if that is ignored, kill."""
        late: Strike | None = None
        until = math.inf
        while True:
            try:
                message = self.get_message("shell", until - time.monotonic() if late else None)
            except Empty:
                sentence = f"Time was up ({self._limit} = {self._most():g}): perhaps a loop that never ends."
                if late:
                    self.strike("timeout", sentence + " It did not stop when interrupted, so its kernel was ended.")
                    raise self._struck from None
                late, until = Strike("timeout", sentence), time.monotonic() + self.limits.grace_seconds
                with contextlib.suppress(zmq.ZMQError):
                    self.kc.control_channel.send(self.kc.session.msg("interrupt_request", {}))
                continue
            if message["parent_header"].get("msg_id") == msg_id:
                if late:
                    raise late
                return

    def get_message(self, stream: str, timeout: float | None = None) -> dict:
        """The next message of a stream; meanwhile the other is read, so that nothing piles up unseen.

        Without a time-out it waits until the limit in force is over, and raises Empty then.
        """
        until = math.inf if timeout is None else time.monotonic() + timeout
        sockets = {self.kc.iopub_channel.socket: "iopub", self.kc.shell_channel.socket: "shell"}
        poller = zmq.Poller()
        for one in (*sockets, *self._cut):
            poller.register(one, zmq.POLLIN)
        while True:
            if self._struck is not None:
                raise self._struck
            if self._ready[stream]:
                return self._ready[stream].popleft()
            left = until - time.monotonic()
            over = timeout is None and spent(self._mark, self.now()) > self._most()
            if left <= 0 or over:
                raise Empty
            readable = dict(poller.poll(min(left, 0.1) * 1000))
            for one in set(readable) & set(sockets):
                self._read(sockets[one], one)
            if set(readable) <= set(self._cut):
                self._look(bool(readable))

    def _look(self, cut: bool) -> None:
        """Strike where the kernel has ended, or a connection to it: by itself, or by a message that is too large."""
        if cut:
            try:  # it may just be ending, which ends connections, too
                self.km.provisioner.process.wait(0.5)
            except subprocess.TimeoutExpired:
                self._limited(
                    "output", "The kernel's connection broke: it sent more at once than allowed", "message_mb"
                )
        if self.group is not None and self.group.killed():
            self._limited("memory", "It used more memory than allowed", "memory_mb")
        elif not self.km.is_alive():
            self.strike("died", "The kernel ended while this task ran: something in it ended the program.")

    def _read(self, stream: str, one: Any) -> None:
        parts = one.recv_multipart(zmq.NOBLOCK)
        size = sum(len(part) for part in parts)
        if size > self.limits.message_mb * 1e6:
            self._limited("output", "The kernel sent more at once than allowed", "message_mb")
            return
        try:
            weigh(parts)
            _, parts = self.kc.session.feed_identities(parts)
            message = self.kc.session.deserialize(parts)
            check_message(message["msg_type"], message["parent_header"], message["content"])
        except Exception as error:  # whatever a hostile kernel sends, the words for it are the same
            self.strike("garbled", f"The kernel sent something that is no message ({type(error).__name__}).")
            return
        kind = message["msg_type"]
        kept = needed(message) if stream == "iopub" else message
        if is_answer(message):
            self._answered += size
            if size > self.limits.answer_mb * 1e6 or self._answered > 2 * self.limits.answer_mb * 1e6:
                self._limited("oversized", "The answer was larger than allowed", "answer_mb")
                return
        elif stream == "iopub" and kind != "status" and kind != "execute_input":
            self._shown += size
        if kept is not None:
            self._ready[stream].append(kept)
        if self._shown > self.limits.output_mb * 1e6 or len(self._ready[stream]) > MOST_WAITING:
            self._limited("output", "It printed more than allowed, perhaps in a loop", "output_mb")

    def _limited(self, code: str, sentence: str, limit: str) -> None:
        self.strike(code, f"{sentence} ({limit} = {getattr(self.limits, limit):g}).")

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
            for one in [self.process, *self.process.children(recursive=True)]:
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
        self._sockets.release()
        if self.group is not None:
            self.group.remove()
        for place in (self._closed, self._open):
            shutil.rmtree(place, ignore_errors=sys.platform != "linux")
