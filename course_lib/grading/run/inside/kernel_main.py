"""The first program in the sandbox: takes limits upon itself, sets what can be imported, and becomes the kernel.

Run as `python -I -S kernel_main.py room.json connection.json bwrap|none`, so that nothing of the machine is on
`sys.path`. Here also live the stand-ins: what a lab imports to draw pictures is there by name and does nothing.
"""

import ctypes
import errno
import importlib
import importlib.abc
import importlib.machinery
import json
import os
import platform
import resource
import struct
import sys
import types

MMAP = {"x86_64": 9, "aarch64": 222}
SOCKET = {"x86_64": 41, "aarch64": 198}
SET_OPTION = {"x86_64": 54, "aarch64": 208}
REFUSED = {
    "x86_64": {
        **{"shmget": 29, "semget": 64, "msgget": 68, "ptrace": 101, "mq_open": 240},
        **{"add_key": 248, "request_key": 249, "keyctl": 250, "perf_event_open": 298, "process_vm_readv": 310},
        **{"process_vm_writev": 311, "memfd_create": 319, "bpf": 321, "userfaultfd": 323, "io_uring_setup": 425},
        **{"io_uring_enter": 426, "io_uring_register": 427, "pidfd_getfd": 438, "memfd_secret": 447},
    },
    "aarch64": {
        **{"ptrace": 117, "mq_open": 180, "msgget": 186, "semget": 190, "shmget": 194},
        **{"add_key": 217, "request_key": 218, "keyctl": 219, "perf_event_open": 241, "process_vm_readv": 270},
        **{"process_vm_writev": 271, "memfd_create": 279, "bpf": 280, "userfaultfd": 282, "io_uring_setup": 425},
        **{"io_uring_enter": 426, "io_uring_register": 427, "pidfd_getfd": 438, "memfd_secret": 447},
    },
}
"""System calls that no lab needs: they hold memory that belongs to no process, so that nobody can count it, or read the
keyring that a process inherits from whoever started the grader."""
ARCHITECTURE = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}


class Absent:
    """Something that is not part of grading: takes whatever is done to it and gives itself back.

    With `speaks`, calling it raises and says that the task does not allow it.
    """

    def __init__(self, name="", speaks=False):
        self.__dict__.update(_name=name, _speaks=speaks)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Absent(f"{self._name}.{name}", self._speaks)

    def __setattr__(self, name, value):
        pass

    def __call__(self, *given, **named):
        if self._speaks:
            raise RuntimeError(f"{self._name} is not here: the task does not allow it")
        return Absent(f"{self._name}()")

    def __getitem__(self, key):
        return Absent(f"{self._name}[]")

    def __setitem__(self, key, value):
        pass

    def __iter__(self):
        return iter(())

    def __len__(self):
        return 0

    def __bool__(self):
        return False

    def __enter__(self):
        return self

    def __exit__(self, *raised):
        return False

    def __repr__(self):
        return f"<{self._name}: not part of grading>"

    def _same(self, *others):
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __neg__ = _same
    __lt__ = __gt__ = __le__ = __ge__ = __matmul__ = __rmatmul__ = __pow__ = _same


class StandIns(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds, last of all, packages that labs import to show things, and parts of the course that are not here."""

    def __init__(self, silent, speaking):
        self.silent, self.speaking = tuple(silent), tuple(speaking)

    def find_spec(self, fullname, path=None, target=None):
        if _within(fullname, self.silent + self.speaking):
            return importlib.machinery.ModuleSpec(fullname, self, is_package=True)
        return None

    def create_module(self, spec):
        module = types.ModuleType(spec.name)
        module.__path__ = []
        speaks = not _within(spec.name, self.silent)
        module.__getattr__ = lambda name: getattr(Absent(spec.name, speaks), name)
        return module

    def exec_module(self, module):
        pass


def _within(name, roots):
    return any(name == root or name.startswith(root + ".") for root in roots)


def take_away(names):
    """Put a refusal in the place of functions of allowed packages that would be the answer: numpy.linalg.inv."""
    for dotted in names:
        place, _, name = dotted.rpartition(".")
        module = importlib.import_module(place)
        thing = getattr(module, name, None)
        refusal = Absent(dotted, speaks=True)
        for other in list(sys.modules.values()):
            if isinstance(other, types.ModuleType) and other.__name__.split(".")[0] == place.split(".")[0]:
                for key, value in list(vars(other).items()):
                    if value is thing or (key == name and type(value).__name__ == "ufunc"):
                        setattr(other, key, refusal)


def _filter(machine):
    """The filter of system calls as lines of (code, lines to skip if true, if false, value); see refuse_calls."""
    load, equal, least, both, give = 0x20, 0x15, 0x35, 0x54, 0x06
    number, arguments = 0, [16 + 8 * i for i in range(4)]
    lines = [(load, 0, 0, 4), (equal, 0, "refuse", ARCHITECTURE[machine]), (load, 0, 0, number)]
    lines.append((least, "refuse", 0, 0x40000000))  # the other numbering that x86-64 has
    lines += [(equal, "refuse", 0, one) for one in sorted(REFUSED[machine].values())]
    shared_without_file, local = 0x01 | 0x20, 1
    lines += [(equal, 0, 4, MMAP[machine]), (load, 0, 0, arguments[3]), (both, 0, 0, shared_without_file)]
    lines += [(equal, "refuse", 0, shared_without_file), (load, 0, 0, number)]
    lines += [(equal, 0, 3, SOCKET[machine]), (load, 0, 0, arguments[0]), (equal, 0, "no network", local)]
    lines += [(load, 0, 0, number)]
    buffers, of_sockets = (7, 8, 32, 33), 1  # their sizes, for sending and receiving, by force or not
    lines += [(equal, 0, 3 + len(buffers), SET_OPTION[machine]), (load, 0, 0, arguments[1])]
    lines += [(equal, 0, 1 + len(buffers), of_sockets), (load, 0, 0, arguments[2])]
    lines += [(equal, "refuse", 0, one) for one in buffers]
    answers = {"allow": 0x7FFF0000, "refuse": 0x00050000 | errno.EPERM, "no network": 0x00050000 | errno.ENETUNREACH}
    places = {name: len(lines) + i for i, name in enumerate(answers)}
    lines += [(give, 0, 0, value) for value in answers.values()]
    return [tuple(places[p] - i - 1 if isinstance(p, str) else p for p in line) for i, line in enumerate(lines)]


def refuse_calls():
    """Have Linux answer "not permitted" to what holds memory that nobody can count; for good.

    That is REFUSED, memory that is shared and has no file, sockets that are not local, and larger buffers of sockets.
    Raises OSError where the filter cannot be set: then nothing is run here.
    """
    machine = platform.machine()
    if machine not in REFUSED:
        return
    lines = _filter(machine)
    program = ctypes.create_string_buffer(b"".join(struct.pack("<HBBI", *line) for line in lines))
    told = ctypes.create_string_buffer(struct.pack("HxxxxxxQ", len(lines), ctypes.addressof(program)))
    libc = ctypes.CDLL(None, use_errno=True)
    no_new_rights, set_filter, with_program = 38, 22, 2
    if libc.prctl(no_new_rights, 1, 0, 0, 0) or libc.prctl(set_filter, with_program, told, 0, 0):
        raise OSError(ctypes.get_errno(), "Linux does not take the filter of system calls")


def publish_locally(kernelapp):
    """Have the kernel open no port for what children print, which is dropped: there are only local sockets here."""

    class Publishing(kernelapp.IOPubThread):
        def __init__(self, socket, **named):
            super().__init__(socket, **{**named, "pipe": False})

        def _really_send(self, *given, **named):
            if self._is_master_process():
                super()._really_send(*given, **named)

    kernelapp.IOPubThread = Publishing


def main():
    place = os.path.dirname(os.path.abspath(sys.argv[1]))
    with open(sys.argv[1], encoding="utf-8") as file:
        room = json.load(file)
    for name, value in room["rlimits"].items():
        kind = getattr(resource, name)
        hard = resource.getrlimit(kind)[1]
        value = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (value, value))
    if sys.argv[3] == "bwrap":
        refuse_calls()
    sys.path[:] = [path for path in sys.path if path != place] + [f"{place}/lib", f"{place}/site"]
    sys.meta_path.append(StandIns(room["silent"], room["speaking"]))
    os.environ["COURSE_COMPILED"] = f"{place}/compiled"  # loops of the course, where this room has any
    take_away(room["taken"])
    from ipykernel import kernelapp

    publish_locally(kernelapp)
    plain_errors = "--InteractiveShell.xmode=Plain"  # only the last line is read; others take 0.1 s to make
    quiet = ["--HistoryManager.enabled=False", "--IPKernelApp.quiet=True", "--log-level=CRITICAL"]
    kernelapp.IPKernelApp.launch_instance(argv=["-f", sys.argv[2], plain_errors, *quiet])


if __name__ == "__main__":
    main()
