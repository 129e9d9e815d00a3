#!/usr/bin/env python3
# ruff: noqa: UP006, UP035, UP045
# This one file also runs on Pythons that are too old for the course, to say so in a sentence: hence its old types.
"""Set up the course and run it: `python3 course.py start` and `python3 course.py test` need no other step.

Standard library only. The first run finds uv (or installs it privately into .uv/), installs exactly what uv.lock says
into .venv/, and checks the Linux libraries that Open3D and VTK need before anything imports them. Later runs do none of
that and need no network. Every verb is then forwarded to `course_lib.classroom.cli` in .venv.

Exit codes of the launcher itself (a verb's own codes are passed on, and lie below 10):

  2  a verb that does not exist              14  the package index cannot be reached
 10  another Python is needed                15  the index lacks a file, or serves another one
 11  no Open3D for this kind of machine      16  the installation failed for another reason
 12  this Linux's C library is too old       17  Linux libraries are missing that Open3D needs
 13  the disk is full                        18  a folder cannot be written
130  interrupted: the same command goes on
"""

import base64
import configparser
import contextlib
import ctypes
import difflib
import errno
import hashlib
import html.parser
import http.client
import json
import os
import platform
import re
import shlex
import shutil
import struct
import subprocess
import sys
import sysconfig
import time
import urllib.error
import urllib.parse
import urllib.request
import zipfile
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
PRIVATE = ROOT / ".uv"  # the private uv, the lock, logs: everything of the set-up that is not the environment itself
LOCK_FILE = ROOT / "uv.lock"

SETUP_VERSION = 1  # raise it when a finished environment of an earlier launcher must be made anew
PYTHONS = ((3, 11), (3, 14))  # requires-python in pyproject.toml
OLDEST_UV = (0, 8)
BYTES_NEEDED = 2_500_000_000  # measured: 1.6 GB in .venv, and what is in flight
PYPI = "https://pypi.org/simple"
DEBIAN_WITH_PYTHON = "python:3.12-bookworm"

EXIT = {
    "usage": 2,
    "python": 10,
    "machine": 11,
    "system": 12,
    "disk": 13,
    "index": 14,
    "content": 15,
    "install": 16,
    "libraries": 17,
    "folder": 18,
    "interrupted": 130,
}

# Each verb, its arguments and its line of help, for before the environment is there; a test compares them with the cli.
VERBS = {
    "start": ("[LESSON] [--no-browser] [--port N] [--stop]", "Open JupyterLab on the course, labs as your own copies."),
    "test": ("[--quick] [--workers N]", "Prove the library, the tools and every notebook."),
    "build": ("[NAME ...] [--check] [--lessons | --labs]", "Turn sources into executed notebooks."),
    "bench": ("[--notebooks] [--only WORD] [--write]", "Measure speed against the professional tools."),
    "data": ("list | get NAME", "List and fetch datasets."),
    "reset": ("LAB [--lesson]", "Make a fresh copy of a lab, overwriting nothing."),
    "release": ("LAB ... --out FOLDER [--hints 0..3]", "Make what students get of a lab: a folder and a zip."),
    "grade": ("FOLDER --out FOLDER [--lab NAME] [--roster FILE]", "Grade a folder of submitted notebooks."),
    "regrade": ("[LAB ...] [--dry-run] [--never-lower]", "After a judge was mended: whose grade changes, and why."),
    "adjust": ("STUDENT LAB TASK --points N --by WHO --reason WHY", "Change a task's points by hand, with a reason."),
    "marks": ("out LAB | in FILE", "Hand-marked tasks: a rubric as CSV, out and in."),
    "feedback": ("[--lab LAB] [--student ID]", "Write an HTML page for each student."),
    "export": ("--format canvas|moodle|csv --out FILE", "Write grades for Canvas, Moodle or a spreadsheet."),
    "class-report": ("--out FILE [--lab LAB]", "Write a page that shows how the class did."),
    "explain": ("STUDENT LAB TASK", "Say how a grade came to be, step by step."),
    "viva": ("STUDENT LAB [--answers]", "Questions to a student about their own code."),
    "forget": ("STUDENT", "Erase a student from the ledger."),
    "doctor": ("[--csv]", "Say what works here, and how to mend the rest."),
}
GRADING = ("test", "bench", "grade", "regrade")  # verbs that run submitted notebooks, in bubblewrap


class Stop(Exception):
    """The launcher cannot go on: one sentence, the command that mends it, and the key of its exit code."""

    def __init__(self, code: str, sentence: str, mend: str = "") -> None:
        super().__init__(sentence)
        self.code, self.sentence, self.mend = code, sentence, mend


class Verdict(NamedTuple):
    """One line of `doctor`: ok is True, False, or None for a remark that is no failure."""

    name: str
    ok: Optional[bool]
    text: str
    mend: str = ""


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def quoted(words: Sequence[str]) -> str:
    """A command line that a person can paste into this system's shell."""
    return subprocess.list2cmdline(list(words)) if os.name == "nt" else " ".join(shlex.quote(str(w)) for w in words)


def this_command() -> List[str]:
    return [sys.argv[0] or "course.py"] + sys.argv[1:]


# --- Is this Python, and this machine, one that the course can run on? ------------------------------------------------


class Facts(NamedTuple):
    """What is known of the running Python and its machine; tests make their own."""

    version: Tuple[int, ...]
    bits: int
    system: str  # Linux, Darwin, Windows
    machine: str  # x86_64, aarch64, arm64, AMD64
    libc: Tuple[str, Tuple[int, ...]] = ("", ())  # ("glibc", (2, 36)), ("musl", ()), or nothing elsewhere
    implementation: str = "CPython"
    free_threaded: bool = False
    translated: bool = False  # an Intel Python on an Apple-silicon Mac


def facts() -> Facts:
    """Look at the running Python."""
    system, libc, translated = platform.system(), ("", ()), False  # type: Any
    if system == "Linux":
        try:
            name, _, number = (os.confstr("CS_GNU_LIBC_VERSION") or "").partition(" ")
        except (ValueError, OSError):
            name, number = "", ""
        libc = ("glibc", tuple(int(n) for n in re.findall(r"\d+", number))) if name == "glibc" else ("musl", ())
    elif system == "Darwin":
        asked = subprocess.run(
            ["sysctl", "-n", "sysctl.proc_translated"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        translated = asked.stdout.strip() == b"1"
    return Facts(
        tuple(sys.version_info[:3]),
        struct.calcsize("P") * 8,
        system,
        platform.machine(),
        libc,
        platform.python_implementation(),
        bool(sysconfig.get_config_var("Py_GIL_DISABLED")),
        translated,
    )


def open3d_tags(lock: str) -> List[str]:
    """The platform tags of every Open3D wheel in uv.lock, for example manylinux_2_35_x86_64."""
    return sorted(set(re.findall(r"/open3d(?:_cpu)?-[^/\"]+-cp\d+-([^-/\"]+)\.whl", lock)))


def check_machine(known: Facts, lock: str) -> None:
    """Refuse a machine or a Python on which nothing can be installed; what cannot be mended comes first.

    Raises
    ------
    Stop
        With one sentence and the command that mends it.
    """
    dotted = ".".join(str(n) for n in known.version)
    tags = open3d_tags(lock)
    machine = {"AMD64": "amd64", "ARM64": "arm64"}.get(known.machine, known.machine)
    suffix = {"Linux": "_" + machine, "Darwin": "_" + machine, "Windows": "win_" + machine}.get(known.system, "?")
    kind = {"Linux": "manylinux", "Darwin": "macosx", "Windows": "win"}.get(known.system, "?")
    fitting = [tag for tag in tags if tag.startswith(kind) and tag.endswith(suffix)]
    arguments = ["course.py"] + sys.argv[1:]
    if known.system == "Darwin" and known.translated:
        raise Stop(
            "machine",
            "This is an Intel Python on an Apple-silicon Mac, and Open3D has no build for Intel Macs.",
            quoted(["arch", "-arm64", "python3"] + arguments),
        )
    if known.system == "Windows" and machine == "arm64" and not fitting:
        raise Stop(
            "machine",
            "Open3D has no build for ARM Pythons on Windows; the 64-bit Intel Python runs here too.",
            "winget install Python.Python.3.12 --architecture x64",
        )
    if not fitting and known.bits == 64:
        name = "Intel Macs" if known.system == "Darwin" else f"{known.system} on {known.machine}"
        raise Stop(
            "machine",
            f"Open3D has no build for {name}: run the course on Linux, Windows or an Apple-silicon Mac, "
            "for example on another machine that you reach with",
            "ssh -L 8888:127.0.0.1:8888 you@other-machine",
        )
    container = f"docker run --rm -it --network host -v {quoted([str(ROOT)])}:/course -w /course {DEBIAN_WITH_PYTHON} "
    container += "python3 " + quoted(arguments)
    floor = max((tuple(int(n) for n in re.findall(r"\d+", tag)[:2]) for tag in fitting), default=(2, 35))
    if known.libc[0] == "musl":
        raise Stop(
            "system", "This Linux uses musl, and Open3D is built for glibc: use a container of Debian.", container
        )
    if known.libc[0] == "glibc" and known.libc[1] < floor:
        raise Stop(
            "system",
            "This Linux has glibc {}, and Open3D needs {} or newer (Ubuntu 22.04, Debian 12): upgrade it, or use a "
            "container.".format(".".join(map(str, known.libc[1])), ".".join(map(str, floor))),
            container,
        )
    wanted = "the course needs CPython {}.{} to {}.{}, 64 bits".format(*PYTHONS[0], *PYTHONS[1])
    if known.bits != 64:
        raise Stop("python", f"This is a {known.bits}-bit Python; {wanted}.", python_to_use(known))
    if known.implementation != "CPython" or known.free_threaded:
        name = "a free-threaded Python" if known.free_threaded else known.implementation
        raise Stop("python", f"This is {name}; {wanted}.", python_to_use(known))
    if not PYTHONS[0] <= known.version[:2] <= PYTHONS[1]:
        raise Stop("python", f"This is Python {dotted}; {wanted}.", python_to_use(known))


def usable_pythons(environment: Mapping[str, str]) -> Iterator[str]:
    """Every Python on PATH, or where installers put it, that the course can use; each is asked, newest first."""
    names = [f"python3.{minor}" for minor in range(PYTHONS[1][1], PYTHONS[0][1] - 1, -1)] + ["python3", "python"]
    on_path = environment.get("PATH", os.defpath).split(os.pathsep)
    elsewhere = sorted(map(str, Path.home().glob(".pyenv/versions/3.*/bin")), reverse=True)
    elsewhere += ["/opt/homebrew/bin", "/usr/local/bin", "/usr/bin"]
    ending = ".exe" if os.name == "nt" else ""
    candidates = [
        os.path.join(f, name + ending) for group in (on_path, elsewhere) for name in names for f in group if f
    ]
    if os.name == "nt":
        for minor in range(PYTHONS[1][1], PYTHONS[0][1] - 1, -1):
            where = f"Programs/Python/Python3{minor}/python.exe"
            candidates.append(os.path.join(environment.get("LOCALAPPDATA", ""), where))
    ask = "import sys, struct, platform as p; "
    ask += "print(*sys.version_info[:2], struct.calcsize('P'), p.python_implementation())"
    for candidate in dict.fromkeys(candidates):
        if not os.access(candidate, os.X_OK) or os.path.isdir(candidate):
            continue
        try:
            run = subprocess.run(
                [candidate, "-c", ask], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=20, check=True
            )
            words = run.stdout.decode("ascii", "replace").split()
        except (OSError, subprocess.SubprocessError):
            continue
        if len(words) == 4 and words[2:] == ["8", "CPython"]:
            if PYTHONS[0] <= (int(words[0]), int(words[1])) <= PYTHONS[1]:
                yield candidate


def python_to_use(known: Facts) -> str:
    """The command that repeats this one with a Python that fits, or that installs such a Python."""
    found = next(usable_pythons(os.environ), None)
    if found:
        return quoted([found] + this_command())
    if known.system == "Darwin":
        return "brew install python@3.12 && python3.12 " + quoted(this_command())
    if known.system == "Windows":
        return "winget install Python.Python.3.12"
    # Ubuntu 22.04, whose own Python is 3.10, has 3.11 beside it; the python3 of later Debians and Ubuntus fits.
    debian = "python3.11" if known.libc[1] == (2, 35) else "python3"
    others = {"fedora": "dnf install -y python3.12", "suse": "zypper install -y python312", "arch": "pacman -S python"}
    return as_administrator(others.get(linux_family(), f"apt-get install -y {debian}"))


# --- The Linux libraries of Open3D and VTK ----------------------------------------------------------------------------

# What the wheels' shared objects name and do not bring (readelf -d over open3d and vtkmodules).
OPEN3D_NEEDS = {
    "x86_64": ["libusb-1.0.so.0", "libudev.so.1"],
    "aarch64": ["libgfortran.so.5"],
    "": ["libEGL.so.1", "libGL.so.1", "libX11.so.6", "libidn2.so.0", "libstdc++.so.6", "libgcc_s.so.1", "libz.so.1"],
}
# One row a library: its package on Debian/Ubuntu (tried), Fedora, openSUSE, Arch (these three untested).
PACKAGES = {
    "libusb-1.0.so.0": ("libusb-1.0-0", "libusb1", "libusb-1_0-0", "libusb"),
    "libudev.so.1": ("libudev1", "systemd-libs", "libudev1", "systemd-libs"),
    "libgfortran.so.5": ("libgfortran5", "libgfortran", "libgfortran5", "gcc-libs"),
    "libEGL.so.1": ("libegl1", "libglvnd-egl", "libglvnd", "libglvnd"),
    "libGL.so.1": ("libgl1", "libglvnd-glx", "libglvnd", "libglvnd"),
    "libX11.so.6": ("libx11-6", "libX11", "libX11-6", "libx11"),
    "libidn2.so.0": ("libidn2-0", "libidn2", "libidn2-0", "libidn2"),
    "libstdc++.so.6": ("libstdc++6", "libstdc++", "libstdc++6", "gcc-libs"),
    "libgcc_s.so.1": ("libgcc-s1", "libgcc", "libgcc_s1", "gcc-libs"),
    "libz.so.1": ("zlib1g", "zlib", "libz1", "zlib"),
    "an EGL driver": ("libegl-mesa0 libgl1-mesa-dri", "mesa-libEGL mesa-dri-drivers", "Mesa-libEGL1 Mesa-dri", "mesa"),
}
FAMILIES = {
    "debian": (0, "apt-get install -y --no-install-recommends"),
    "fedora": (1, "dnf install -y"),
    "suse": (2, "zypper install -y"),
    "arch": (3, "pacman -S --needed"),
}


def loads(library: str) -> bool:
    """Whether the dynamic linker finds a shared library, and everything that it needs itself."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def draws() -> bool:
    """Whether EGL has a driver to draw with: libEGL only hands on to the drivers that these files name."""
    named = os.environ.get("__EGL_VENDOR_LIBRARY_FILENAMES", "")
    folders = os.environ.get("__EGL_VENDOR_LIBRARY_DIRS", "/etc/glvnd/egl_vendor.d:/usr/share/glvnd/egl_vendor.d")
    files = [Path(name) for name in named.split(":") if name]
    files = files or [file for folder in folders.split(":") for file in sorted(Path(folder).glob("*.json"))]
    for file in files:
        found = (
            re.search(r'"library_path"\s*:\s*"([^"]+)"', file.read_text(encoding="utf-8")) if file.is_file() else None
        )
        if found and loads(found.group(1)):
            return True
    return loads("libEGL_mesa.so.0")


def missing_libraries(known: Facts) -> Tuple[List[str], List[str]]:
    """The libraries without which Open3D cannot load, and those without which only pictures suffer."""
    if known.system != "Linux":
        return [], []
    needed = OPEN3D_NEEDS.get(known.machine, []) + OPEN3D_NEEDS[""]
    return [name for name in needed if not loads(name)], [] if draws() else ["an EGL driver"]


def linux_family() -> str:
    """debian, fedora, suse or arch, from /etc/os-release; "" where it is another or says nothing."""
    try:
        text = Path("/etc/os-release").read_text(encoding="utf-8")
    except OSError:
        return ""
    words = " ".join(re.findall(r"^(?:ID|ID_LIKE)=\"?([^\"\n]*)", text, re.M)).split()
    names = {"ubuntu": "debian", "rhel": "fedora", "centos": "fedora", "opensuse": "suse"}
    return next((names.get(word, word) for word in words if names.get(word, word) in FAMILIES), "")


def library_command(missing: Sequence[str], family: str) -> str:
    """The line that an administrator runs to install these libraries; "" where none is missing."""
    column, command = FAMILIES.get(family, FAMILIES["debian"])
    packages = sorted(set(" ".join(PACKAGES[name][column] for name in missing).split()))
    return as_administrator(f"{command} {' '.join(packages)}") if packages else ""


def ensure_sandbox(known: Facts) -> None:
    """Install bubblewrap, in which submitted notebooks run, as root on Debian or Ubuntu; elsewhere name the line."""
    if known.system != "Linux" or shutil.which("bwrap"):
        return
    command = FAMILIES.get(linux_family(), FAMILIES["debian"])[1]
    line = as_administrator(f"{command} bubblewrap")
    if linux_family() == "debian" and is_administrator() and shutil.which("apt-get"):
        say(f"Installing the sandbox of submitted notebooks: {line}")
        apt_get(line)
    if not shutil.which("bwrap"):
        say(f"Submitted notebooks run in bubblewrap, which an administrator installs with this line:\n    {line}")


def is_administrator() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0


def as_administrator(command: str) -> str:
    return command if is_administrator() else f"sudo {command}"


def ensure_libraries(known: Facts) -> None:
    """Install the Linux libraries as root on Debian or Ubuntu; elsewhere say what is missing and who can install it.

    Raises
    ------
    Stop
        If Open3D cannot load. Without a driver to draw with, only a remark is printed.
    """
    vital, drawing = missing_libraries(known)
    family = linux_family()
    if (vital or drawing) and family == "debian" and is_administrator() and shutil.which("apt-get"):
        command = library_command(vital + drawing, family)
        say(f"Installing Linux libraries of Open3D and VTK: {command}")
        apt_get(command)
        vital, drawing = missing_libraries(known)
    line = library_command(vital + drawing, family)
    tried = "" if family == "debian" else " (untested on this Linux)"
    if vital:
        names = ", ".join(vital)
        sentence = (
            f"Open3D cannot load without {names}; an administrator installs what is missing with this line{tried}:"
        )
        raise Stop("libraries", sentence, line)
    if drawing:
        say("There is no driver to draw 3D with: everything works, with clouds and meshes drawn by matplotlib.")
        say(f"An administrator adds one with this line{tried}:\n    {line}")


def apt_get(command: str) -> None:
    """Run an apt-get line after `apt-get update`, asking nothing; what it says goes to .uv/apt.log."""
    environment = dict(os.environ, DEBIAN_FRONTEND="noninteractive")
    options = ["-o", "DPkg::Lock::Timeout=300", "-o", "APT::Sandbox::User=root", "-qq"]
    with open(str(PRIVATE / "apt.log"), "wb") as file:
        for words in (["apt-get", "update"], command.split()):
            words[1:1] = options
            subprocess.call(words, stdin=subprocess.DEVNULL, stdout=file, stderr=file, env=environment)


# --- The package index in force ---------------------------------------------------------------------------------------


class Index(NamedTuple):
    """Where packages come from: what UV_*, PIP_* and pip's own configuration say, in this order."""

    url: str = PYPI
    extra: Tuple[str, ...] = ()
    find_links: Tuple[str, ...] = ()
    no_index: bool = False
    trusted: Tuple[str, ...] = ()
    certificates: str = ""
    proxy: str = ""


def pip_configuration_files(environment: Mapping[str, str]) -> List[Path]:
    """pip's configuration files, the last one winning."""
    home = Path(os.path.expanduser("~"))
    named = environment.get("PIP_CONFIG_FILE", "")
    if named == os.devnull:
        return []
    if os.name == "nt":
        files = [Path(environment.get("ProgramData", "C:/ProgramData")) / "pip/pip.ini", home / "pip/pip.ini"]
        files += [Path(environment.get("APPDATA", str(home))) / "pip/pip.ini", Path(sys.prefix) / "pip.ini"]
    else:
        shared = environment.get("XDG_CONFIG_DIRS") or "/etc/xdg"
        files = [Path(folder) / "pip/pip.conf" for folder in reversed(shared.split(":"))] + [Path("/etc/pip.conf")]
        if sys.platform == "darwin":
            files = [Path("/Library/Application Support/pip/pip.conf")]
            files += [home / "Library/Application Support/pip/pip.conf"]
        personal = Path(environment.get("XDG_CONFIG_HOME") or str(home / ".config"))
        files += [home / ".pip/pip.conf", personal / "pip/pip.conf", Path(sys.prefix) / "pip.conf"]
    return files + ([Path(named)] if named else [])


def pip_configuration(files: Sequence[Path]) -> Dict[str, str]:
    """What pip's files say for an installation, keys with dashes."""
    found = {}  # type: Dict[str, str]
    for section in ("global", "install"):  # the command's own section wins over the global one
        for file in files:
            parser = configparser.RawConfigParser(strict=False)
            try:
                parser.read_string(file.read_text(encoding="utf-8-sig"))
            except (OSError, UnicodeDecodeError, configparser.Error):
                continue  # absent, or not one that pip could read either
            if parser.has_section(section):
                found.update((key.lower().replace("_", "-"), value) for key, value in parser.items(section))
    return found


def index_in_force(environment: Mapping[str, str], files: Optional[Sequence[Path]] = None) -> Index:
    """Read which package index, certificates and proxy hold here."""
    configured = pip_configuration(pip_configuration_files(environment) if files is None else files)

    def pip(key: str) -> str:
        return environment.get("PIP_" + key.upper().replace("-", "_")) or configured.get(key, "")

    def several(*texts: str) -> Tuple[str, ...]:
        words = [re.sub(r"^[A-Za-z0-9_.-]+=(?=[a-z]+:)", "", word) for text in texts for word in text.split()]
        return tuple(dict.fromkeys(words))

    uv = environment.get("UV_DEFAULT_INDEX") or environment.get("UV_INDEX_URL") or ""
    links = several(environment.get("UV_FIND_LINKS", "").replace(",", " "), pip("find-links"))
    certificates = environment.get("SSL_CERT_FILE") or pip("cert")
    for other in ("REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE"):
        certificates = certificates or environment.get(other, "")
    return Index(
        url=(several(uv or pip("index-url")) or (PYPI,))[0].rstrip("/"),
        extra=several(
            environment.get("UV_INDEX", ""), environment.get("UV_EXTRA_INDEX_URL", ""), pip("extra-index-url")
        ),
        find_links=tuple(link for link in links if "://" in link or os.path.isdir(link)),
        no_index=pip("no-index").lower() in ("1", "true", "yes", "on") or bool(environment.get("UV_NO_INDEX")),
        trusted=several(environment.get("UV_INSECURE_HOST", "").replace(",", " "), pip("trusted-host")),
        certificates=certificates if os.path.exists(certificates) else "",
        proxy=pip("proxy"),
    )


def without_secret(url: str) -> str:
    """An address as it may be printed: without user name and password."""
    parts = urllib.parse.urlsplit(url)
    return urllib.parse.urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))


def _origin(url: str) -> Tuple[str, str]:
    parts = urllib.parse.urlsplit(url)
    return parts.scheme, parts.netloc.rpartition("@")[2]


class _Redirects(urllib.request.HTTPRedirectHandler):
    """Follows redirects, and takes the password along to the same host only."""

    def redirect_request(self, req: Any, fp: Any, code: int, msg: str, headers: Any, newurl: str) -> Any:
        new = super().redirect_request(req, fp, code, msg, headers, newurl)
        secret = req.unredirected_hdrs.get("Authorization")
        if new is not None and secret and _origin(newurl) == _origin(req.full_url):
            new.add_unredirected_header("Authorization", secret)
        return new


def _secret(url: str, index: Index) -> str:
    """The Authorization header for an address: from itself, from the index on the same host, or from netrc."""
    for address in (url,) + tuple(a for a in (index.url,) + index.extra if _origin(a) == _origin(url)):
        parts = urllib.parse.urlsplit(address)
        if parts.username:
            pair = urllib.parse.unquote(parts.username), urllib.parse.unquote(parts.password or "")
            break
    else:
        import netrc

        try:
            login = netrc.netrc(os.environ.get("NETRC")).authenticators(urllib.parse.urlsplit(url).hostname or "")
        except (OSError, netrc.NetrcParseError):
            login = None
        if not login:
            return ""
        pair = login[0], login[2] or ""
    return "Basic " + base64.b64encode(":".join(pair).encode("utf-8")).decode("ascii")


def open_url(url: str, index: Index, **headers: str) -> Any:
    """Open an address with the certificates, proxy and password in force."""
    import ssl

    file = index.certificates if os.path.isfile(index.certificates) else None
    context = ssl.create_default_context(
        cafile=file, capath=index.certificates if index.certificates and not file else None
    )
    parts = urllib.parse.urlsplit(url)
    if parts.hostname in index.trusted or _origin(url)[1] in index.trusted:
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # what is fetched is checked by its hash
    handlers = [_Redirects(), urllib.request.HTTPSHandler(context=context)]  # type: List[Any]
    if index.proxy and not urllib.request.getproxies():
        handlers.append(urllib.request.ProxyHandler({"http": index.proxy, "https": index.proxy}))
    request = urllib.request.Request(without_secret(url), headers={"User-Agent": "course.py"})
    for key, value in headers.items():
        request.add_header(key, value)
    secret = _secret(url, index)
    if secret:
        request.add_unredirected_header("Authorization", secret)
    return urllib.request.build_opener(*handlers).open(request, timeout=30)


class _Links(html.parser.HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.links = []  # type: List[str]

    def handle_starttag(self, tag: str, attrs: List[Tuple[str, Optional[str]]]) -> None:
        self.links += [value for key, value in attrs if tag == "a" and key == "href" and value]


def link_to(filename: str, page: str, page_url: str) -> Optional[str]:
    """The absolute address of a file on a page of the simple API, HTML or JSON; None where it is not there."""
    if page.lstrip().startswith("{"):
        links = [file["url"] for file in json.loads(page).get("files", []) if file.get("filename") == filename]
    else:
        parser = _Links()
        parser.feed(page)
        links = parser.links
    for link in links:
        address = urllib.parse.urldefrag(urllib.parse.urljoin(page_url, link))[0]
        if urllib.parse.unquote(urllib.parse.urlsplit(address).path).rpartition("/")[2] == filename:
            return address
    return None


def unreachable(index: Index, reason: object) -> Stop:
    """The sentence for an index that does not answer."""
    if isinstance(reason, urllib.error.HTTPError):
        reason = f"HTTP {reason.code} {reason.reason}"
    reason = getattr(reason, "reason", None) or reason
    reason = getattr(reason, "strerror", None) or reason
    if "CERTIFICATE_VERIFY_FAILED" in str(reason):
        told = "name the file of your institution's certificates"
        return Stop(
            "index",
            f"The certificate of the package index {without_secret(index.url)} is not trusted here: {told}.",
            _with_variable("SSL_CERT_FILE", "/path/to/certificates.pem"),
        )
    told = str(reason) or type(reason).__name__
    return Stop(
        "index",
        f"The package index {without_secret(index.url)} cannot be reached ({told}): check the network, or name your "
        "institution's index.",
        _with_variable("UV_DEFAULT_INDEX", "https://packages.example.org/simple"),
    )


def _with_variable(name: str, value: str) -> str:
    if os.name == "nt":
        return f'$env:{name} = "{value}"; py {quoted(this_command())}'
    return f"{name}={value} python3 {quoted(this_command())}"


# --- uv: found, or installed privately --------------------------------------------------------------------------------


class Wheel(NamedTuple):
    """A wheel as uv.lock names it."""

    version: str
    filename: str
    sha256: str


def locked_uv(lock: str, known: Facts) -> Wheel:
    """The wheel of uv in uv.lock for this machine."""
    import tomllib  # here the Python is one that the course can use

    package = next(p for p in tomllib.loads(lock)["package"] if p["name"] == "uv")
    kind = {"Linux": "manylinux", "Darwin": "macosx", "Windows": "win"}[known.system]
    for wheel in package["wheels"]:
        filename = wheel["url"].rpartition("/")[2]
        tags = filename[: -len(".whl")].split("-")[-1].split(".")
        if any(tag.startswith(kind) and tag.endswith("_" + known.machine.lower()) for tag in tags):
            return Wheel(package["version"], filename, wheel["hash"].partition(":")[2])
    raise Stop("install", f"uv.lock names no uv for {known.system} {known.machine}.", "git checkout uv.lock")


def found_uv() -> Optional[str]:
    """A uv on PATH that is recent enough."""
    uv = shutil.which("uv")
    if not uv:
        return None
    try:
        text = subprocess.run([uv, "--version"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=30).stdout
    except (OSError, subprocess.SubprocessError):
        return None
    version = re.search(rb"^uv (\d+)\.(\d+)", text)
    return uv if version and tuple(int(n) for n in version.groups()) >= OLDEST_UV else None


def private_uv(wheel: Wheel, index: Index) -> str:
    """Install uv into .uv/ from its wheel, fetched from the index in force and checked by its hash."""
    name = "uv.exe" if os.name == "nt" else "uv"
    program = PRIVATE / f"uv-{wheel.version}" / name
    if program.exists():
        return str(program)
    PRIVATE.mkdir(exist_ok=True)
    archive = PRIVATE / wheel.filename
    if not (archive.exists() and sha256(archive) == wheel.sha256):
        say(f"Fetching uv {wheel.version} from {without_secret(index.url)}")
        fetch(wheel, archive, index)
    program.parent.mkdir(exist_ok=True)
    part = program.parent / (name + ".part")
    with zipfile.ZipFile(str(archive)) as files, open(str(part), "wb") as target:
        inside = next(n for n in files.namelist() if n.endswith("/scripts/" + name))
        shutil.copyfileobj(files.open(inside), target)
    os.chmod(str(part), 0o755)
    os.replace(str(part), str(program))
    archive.unlink()
    return str(program)


def fetch(wheel: Wheel, target: Path, index: Index) -> None:
    """Fetch a wheel: from a folder of wheels, the index, or an extra one; the first that has it.

    Raises
    ------
    Stop
        If no index can be reached, none has the file, or its bytes are not the ones of uv.lock.
    """
    for folder in index.find_links:
        copy = Path(folder) / wheel.filename
        if copy.is_file() and sha256(copy) == wheel.sha256:
            shutil.copyfile(str(copy), str(target))
            return
    trouble = None  # type: Any
    for place in () if index.no_index else (index.url,) + index.extra:
        page_url = place.rstrip("/") + "/uv/"
        try:
            accept = "application/vnd.pypi.simple.v1+json, text/html;q=0.5"
            with open_url(page_url, index, Accept=accept) as answer:
                page, page_url = answer.read().decode("utf-8"), answer.geturl()
        except urllib.error.HTTPError as error:
            trouble = trouble if error.code == 404 else error
            continue
        except (OSError, http.client.HTTPException) as error:
            trouble = error
            continue
        link = link_to(wheel.filename, page, page_url)
        if link:
            download(link, target, wheel.sha256, index)
            return
    if trouble:
        raise unreachable(index, trouble)
    raise Stop(
        "content",
        f"The package index {without_secret(index.url)} does not hold {wheel.filename}: ask its keeper for it, or name "
        "another index.",
        _with_variable("UV_DEFAULT_INDEX", PYPI),
    )


def download(url: str, target: Path, expected: str, index: Index) -> None:
    """Download to `target`, resuming what an earlier run left, and only ever leaving a whole and right file there."""
    part = target.with_name(target.name + ".part")
    trouble = OSError("no answer")  # type: Any
    for attempt in range(4):
        if attempt:
            time.sleep(attempt)
        have = part.stat().st_size if part.exists() else 0
        try:
            with open_url(url, index, **({"Range": f"bytes={have}-"} if have else {})) as answer:
                resumed = answer.status == 206 and have > 0
                with open(str(part), "ab" if resumed else "wb") as file:
                    shutil.copyfileobj(answer, file, 1 << 20)
            if sha256(part) == expected:
                os.replace(str(part), str(target))
                return
            length = answer.headers.get("Content-Length")
            if not length or part.stat().st_size >= int(length) + (have if resumed else 0):
                part.unlink()  # whole, and wrong: perhaps another file was resumed, so once more from its beginning
                trouble = None
                if not resumed:
                    break
        except urllib.error.HTTPError as error:
            trouble = error
            part.unlink() if error.code == 416 else None
        except (http.client.HTTPException, urllib.error.URLError, ConnectionError, TimeoutError) as error:
            trouble = error
    if trouble is not None:
        raise unreachable(index, trouble)
    raise Stop(
        "content",
        f"{without_secret(url)} is not the file that uv.lock names (its sha256 differs): the index, or "
        "something on the way, changed it.",
        _with_variable("UV_DEFAULT_INDEX", PYPI),
    )


def sha256(path: Path) -> str:
    digest = hashlib.sha256()
    with open(str(path), "rb") as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            digest.update(block)
    return digest.hexdigest()


# --- The environment --------------------------------------------------------------------------------------------------


def venv_python() -> Path:
    return VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def stamp() -> Dict[str, Any]:
    """What the finished set-up wrote down; empty where there is none."""
    try:
        return json.loads((VENV / ".course.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def expected_stamp(python: str) -> Dict[str, Any]:
    return {
        "setup": SETUP_VERSION,
        "lock": hashlib.sha256(LOCK_FILE.read_bytes().replace(b"\r\n", b"\n")).hexdigest(),
        "python": python,
        "base": os.path.realpath(str(venv_python())),  # an upgraded system Python is another file
    }


def is_ready() -> bool:
    """Whether .venv is finished and is what uv.lock says. Reads three small files, starts nothing."""
    found = stamp()
    return venv_python().exists() and bool(found) and found == expected_stamp(found.get("python", ""))


@contextlib.contextmanager
def one_at_a_time() -> Iterator[int]:
    """Hold the lock of the set-up. The system lets go of it when the process dies, however it dies."""
    PRIVATE.mkdir(exist_ok=True)
    handle = os.open(str(PRIVATE / "lock"), os.O_RDWR | os.O_CREAT, 0o644)
    waited = False
    try:
        while not _try_lock(handle):
            if not waited:
                say("Another command is setting up this folder; waiting for it to finish.")
            waited = True
            time.sleep(0.2)
        yield handle
    finally:
        os.close(handle)


def _try_lock(handle: int) -> bool:
    try:
        if os.name == "nt":
            import msvcrt

            os.lseek(handle, 0, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        # A file system without locks (some network shares): better one set-up at a time by luck than none.
        return error.errno in (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)
    return True


def uv_environment(index: Index) -> Dict[str, str]:
    """The environment for uv: the index in force, and nothing that would change what is installed or where."""
    drop = """VIRTUAL_ENV CONDA_PREFIX PYTHONPATH PYTHONHOME UV_PROJECT UV_PROJECT_ENVIRONMENT UV_WORKING_DIRECTORY
        UV_PYTHON UV_SYSTEM_PYTHON UV_FROZEN UV_EXCLUDE_NEWER UV_CONSTRAINT UV_OVERRIDE UV_NO_BINARY UV_ONLY_BINARY
        UV_VENV_SEED UV_TORCH_BACKEND UV_INDEX_URL UV_EXTRA_INDEX_URL"""
    environment = {key: value for key, value in os.environ.items() if key not in drop.split()}
    if index.url != PYPI:
        environment["UV_DEFAULT_INDEX"] = index.url
    if index.extra:
        environment["UV_INDEX"] = " ".join(index.extra)
        environment.setdefault("UV_INDEX_STRATEGY", "unsafe-best-match")  # every file is pinned by its hash
    environment["UV_FIND_LINKS"] = ",".join(index.find_links)
    if index.trusted:
        environment["UV_INSECURE_HOST"] = " ".join(index.trusted)
    if index.certificates:
        environment.setdefault(
            "SSL_CERT_DIR" if os.path.isdir(index.certificates) else "SSL_CERT_FILE", index.certificates
        )
    if index.proxy and not urllib.request.getproxies():
        environment["ALL_PROXY"] = index.proxy
    environment.setdefault("UV_HTTP_TIMEOUT", "120")
    environment["UV_PYTHON_DOWNLOADS"] = "never"
    if not os.access(str(existing(cache_folder(environment))), os.W_OK):
        environment["UV_CACHE_DIR"] = str(PRIVATE / "cache")
    if existing(cache_folder(environment)).stat().st_dev != ROOT.stat().st_dev:
        environment.setdefault("UV_LINK_MODE", "copy")  # files cannot be linked from another disk
    return environment


def cache_folder(environment: Mapping[str, str]) -> Path:
    """Where uv keeps what it has downloaded."""
    if environment.get("UV_CACHE_DIR"):
        return Path(environment["UV_CACHE_DIR"]).absolute()
    if os.name == "nt":
        return Path(environment.get("LOCALAPPDATA") or str(ROOT)) / "uv/cache"
    return Path(environment.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")).absolute() / "uv"


def existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that is there."""
    return folder if folder.exists() else existing(folder.parent)


def check_disk(needed: int = BYTES_NEEDED) -> None:
    """Refuse to begin what will not fit."""
    for place in (ROOT, existing(cache_folder(os.environ))):
        free = shutil.disk_usage(str(place)).free
        if free < needed:
            raise disk_full(place, free, needed)


def disk_full(place: Path, free: int, needed: int = BYTES_NEEDED) -> Stop:
    """The sentence for a full disk; it names the folder."""
    sentence = f"The disk of {place} has {free / 1e9:.1f} GB free, and the installation needs {needed / 1e9:.1f} GB: "
    sentence += "make room, or "
    if place == ROOT:
        return Stop(
            "disk",
            sentence + "move the course.",
            quoted(["mv" if os.name != "nt" else "move", str(ROOT), "/another/disk/"]),
        )
    return Stop(
        "disk", sentence + "put uv's cache elsewhere.", _with_variable("UV_CACHE_DIR", "/another/disk/uv-cache")
    )


def set_up(known: Facts, lock_handle: int) -> None:
    """Make .venv exactly what uv.lock says. Killed at any point, the next call completes it.

    Raises
    ------
    Stop
        With one sentence, where something outside is in the way.
    """
    check_disk()
    index = index_in_force(os.environ)
    began = time.monotonic()
    say(f"Setting up the course in {ROOT} (once; about 1.6 GB).")
    uv = found_uv() or private_uv(locked_uv(LOCK_FILE.read_text(encoding="utf-8"), known), index)
    unfinished = PRIVATE / "unfinished"
    anew = unfinished.exists() or _version_of(venv_python()) is None
    unfinished.write_text("A set-up began here and has not finished yet.\n", encoding="utf-8")
    with contextlib.suppress(FileNotFoundError):
        (VENV / ".course.json").unlink()
    if anew:
        base = os.path.realpath(getattr(sys, "_base_executable", None) or sys.executable)
        run_uv([uv, "venv", "--quiet", "--clear", "--relocatable", "--python", base, str(VENV)], index, lock_handle)
    wanted = PRIVATE / "requirements.txt"
    export = [uv, "export", "--quiet", "--frozen", "--no-emit-project", "--format", "requirements.txt"]
    run_uv(export + ["--python", str(venv_python()), "--output-file", str(wanted)], index, lock_handle)
    install(uv, wanted, venv_python(), index, lock_handle)
    packages = site_packages()
    # One relative line, so that the folder may be moved or renamed.
    (packages / "course.pth").write_text(os.path.relpath(str(ROOT), str(packages)) + "\n", encoding="ascii")
    write_whole(VENV / ".course.json", json.dumps(expected_stamp(_version_of(venv_python()) or "")))
    unfinished.unlink()
    say(f"Set up in {time.monotonic() - began:.0f} s; from now on no network is needed.")


def install(uv: str, wanted: Path, python: Path, index: Index, lock_handle: int) -> None:
    """Bring an environment to exactly a list of hashed requirements, from the index in force.

    `uv sync` would take the addresses of files from uv.lock, whatever index an institution names.
    """
    words = [uv, "pip", "sync", "--require-hashes", "--only-binary", ":all:", "--python", str(python), str(wanted)]
    run_uv(words + (["--no-index"] if index.no_index else []), index, lock_handle)


def _version_of(python: Path) -> Optional[str]:
    """The version of an environment's Python if the course can use it; None where it does not run or is another."""
    try:
        ask = "import platform, sys; print(platform.python_version(), sys.prefix != sys.base_prefix)"
        run = subprocess.run(
            [str(python), "-I", "-c", ask], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=60
        )
    except (OSError, subprocess.SubprocessError):
        return None
    words = run.stdout.decode("ascii", "replace").split()
    if run.returncode or len(words) != 2 or words[1] != "True":
        return None
    return words[0] if PYTHONS[0] <= tuple(int(n) for n in re.findall(r"\d+", words[0])[:2]) <= PYTHONS[1] else None


def site_packages() -> Path:
    return VENV / "Lib/site-packages" if os.name == "nt" else next((VENV / "lib").glob("python3.*/site-packages"))


def write_whole(path: Path, text: str) -> None:
    """Write a small file so that it is there whole or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    os.replace(str(part), str(path))


def run_uv(words: List[str], index: Index, lock_handle: int) -> None:
    """Run uv: its own progress on a terminal, quiet otherwise; its failure becomes one sentence.

    The child inherits the lock, so that a uv that outlives a killed launcher is waited for by the next one.
    """
    environment = uv_environment(index)
    options = {"env": environment, "cwd": str(ROOT), "stdin": subprocess.DEVNULL}  # type: Dict[str, Any]
    if os.name != "nt":
        options["pass_fds"] = (lock_handle,)
    log = PRIVATE / "uv.log"
    if sys.stderr.isatty():
        code, said = subprocess.call(words, **options), ""
    else:
        with open(str(log), "wb") as file:
            code = subprocess.call(words, stdout=file, stderr=subprocess.STDOUT, **options)
        said = log.read_text(encoding="utf-8", errors="replace")
    if code:
        raise why_uv_failed(said, code, index, environment)


def why_uv_failed(said: str, code: int, index: Index, environment: Mapping[str, str]) -> Stop:
    """Find the cause of a failed uv among those that have a sentence of their own."""
    folders = [folder for folder in (ROOT, cache_folder(environment)) if folder.exists()]
    free, folder = min((shutil.disk_usage(str(folder)).free, folder) for folder in folders)
    if free < 100_000_000 or "No space left" in said or "os error 112" in said:
        return disk_full(folder, free)
    if re.search(r"hash mismatch", said, re.I):
        return Stop(
            "content",
            f"The package index {without_secret(index.url)} serves a file with another hash than uv.lock's.",
            _with_variable("UV_DEFAULT_INDEX", PYPI),
        )
    try:
        with open_url(index.url.rstrip("/") + "/uv/", index):
            pass
    except (OSError, http.client.HTTPException) as error:  # a URLError is an OSError
        if getattr(error, "code", None) != 404 and not index.no_index:
            return unreachable(index, error)
    lines = [line.strip() for line in said.splitlines() if line.strip()][-12:]
    if lines:
        say("\n".join("  uv: " + line for line in lines))
    return Stop(
        "install",
        f"uv could not install the packages (its exit code is {code}, its words stand above): run it again, and if it "
        "stays, ask with the text of",
        "python3 course.py doctor",
    )


# --- The command line -------------------------------------------------------------------------------------------------


def help_text(verb: str = "") -> str:
    """What `--help` prints before the environment is there."""
    if verb:
        return f"Usage: python3 course.py {verb} {VERBS[verb][0]}\n\n  {VERBS[verb][1]}\n"
    lines = "Usage: python3 course.py VERB [...]\n\nA course on 3D reconstruction. Two commands do all the set-up:\n\n"
    lines += "  python3 course.py start    open the course\n  python3 course.py test     prove it\n\nVerbs:\n"
    lines += "".join(f"  {name:<14}{line}\n" for name, (_, line) in VERBS.items())
    return lines + "\n`python3 course.py VERB --help` explains a verb.\n\n" + (__doc__ or "").split("\n\n", 2)[2]


def basic_verdicts(known: Facts) -> List[Verdict]:
    """The part of `doctor` that needs no environment. Asks nothing of the network."""
    verdicts = []
    text = "Python {} ({}, {} bits) on {} {}".format(
        ".".join(map(str, known.version)), known.implementation, known.bits, known.system, known.machine
    )
    if known.libc[0]:
        text += ", {} {}".format(known.libc[0], ".".join(map(str, known.libc[1])))
    try:
        check_machine(known, LOCK_FILE.read_text(encoding="utf-8"))
        verdicts.append(Verdict("Python", True, text))
    except Stop as stop:
        verdicts.append(Verdict("Python", False, f"{stop.sentence} ({text})", stop.mend))
    vital, drawing = missing_libraries(known)
    if known.system == "Linux":
        line = library_command(vital + drawing, linux_family())
        told = "Open3D cannot load without " + ", ".join(vital) if vital else "what Open3D needs is there"
        verdicts.append(Verdict("Linux libraries", not vital, told, line if vital else ""))
        if drawing and not is_ready():  # else `doctor` tries to draw
            told = "no EGL driver: pictures of clouds and meshes are drawn by matplotlib"
            verdicts.append(Verdict("3D driver", None, told, line))
    free = shutil.disk_usage(str(ROOT)).free
    enough = free >= (BYTES_NEEDED if not is_ready() else BYTES_NEEDED // 10)
    told = f"{free / 1e9:.1f} GB free where the course lies"
    mend = "" if enough else f"make room: the installation needs {BYTES_NEEDED / 1e9:.1f} GB"
    verdicts.append(Verdict("disk", enough, told, mend))
    return verdicts


def doctor_before_set_up(known: Facts, as_csv: bool) -> int:
    """`doctor` where there is no environment yet: it reports and installs nothing."""
    index = index_in_force(os.environ)
    verdicts = basic_verdicts(known) + [Verdict("environment", False, "not set up", "python3 course.py start")]
    try:
        with open_url(index.url.rstrip("/") + "/uv/", index):
            verdicts.append(Verdict("package index", True, without_secret(index.url)))
    except (OSError, http.client.HTTPException) as error:
        stop = unreachable(index, error)
        verdicts.append(Verdict("package index", False, stop.sentence, stop.mend))
    print_verdicts(verdicts, as_csv)
    return 1


def print_verdicts(verdicts: Sequence[Verdict], as_csv: bool) -> None:
    """Print one line a verdict, with its mend; no user name and no path above the home folder."""

    def clean(text: str) -> str:
        text = text.replace(str(ROOT), "course")
        home = os.path.expanduser("~")
        return text.replace(home, "~") if len(home) > 1 else text

    words = {True: "ok", False: "FAIL", None: "note"}
    if as_csv:
        import csv

        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(["verdict", "name", "text", "mend"])
        writer.writerows([words[v.ok], v.name, clean(v.text), clean(v.mend)] for v in verdicts)
        return
    for v in verdicts:
        mend = f"  ->  {clean(v.mend)}" if v.mend else ""
        print(f"{words[v.ok]:<5} {v.name:<17}{clean(v.text)}{mend}")


def child_environment() -> Dict[str, str]:
    """The environment of every verb: this .venv first, and nothing of other Pythons (ROS sets PYTHONPATH)."""
    drop = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP")
    drop += ("PYTHONDONTWRITEBYTECODE",)  # each kernel would compile its thousand modules again
    environment = {key: value for key, value in os.environ.items() if key not in drop}
    environment["PATH"] = str(venv_python().parent) + os.pathsep + environment.get("PATH", os.defpath)
    environment["VIRTUAL_ENV"] = str(VENV)
    environment["PYTHONUTF8"] = "1"
    return environment


def forward(arguments: List[str]) -> int:
    """Run a verb in .venv. Exit code, signals and terminal are the verb's own."""
    words = [str(venv_python()), "-P", "-m", "course_lib.classroom.cli"] + arguments
    sys.stdout.flush()
    sys.stderr.flush()
    if os.name != "nt":
        os.execve(words[0], words, child_environment())
    child = subprocess.Popen(words, env=child_environment())
    while True:
        try:
            return child.wait()
        except KeyboardInterrupt:  # the child has had it too, and decides
            continue


def run(arguments: List[str]) -> int:
    """Do what the command line says and return the exit code.

    Raises
    ------
    Stop
        With one sentence, where the launcher cannot go on.
    """
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(help_text(), end="")
        return 0
    verb = arguments[0]
    if verb not in VERBS:
        near = difflib.get_close_matches(verb, list(VERBS), n=1, cutoff=0.5)
        meant = "did you mean this?" if near else "see the verbs with:"
        mend = ["python3", "course.py"] + (near + arguments[1:] if near else ["--help"])
        raise Stop("usage", f"There is no verb {verb!r}; {meant}", quoted(mend))
    known = facts()
    asks_help = any(word in ("-h", "--help") for word in arguments[1:])
    ready = is_ready()
    if asks_help and not ready:
        print(help_text(verb), end="")
        return 0
    if verb == "doctor" and not ready:
        return doctor_before_set_up(known, "--csv" in arguments)
    check_machine(known, LOCK_FILE.read_text(encoding="utf-8"))
    imports_open3d = verb not in ("doctor", "reset") and not asks_help
    if not ready or (imports_open3d and missing_libraries(known)[0]):
        with one_at_a_time() as handle:
            if imports_open3d:
                ensure_libraries(known)
            if not is_ready():
                set_up(known, handle)
    if verb in GRADING and not asks_help:
        ensure_sandbox(known)
    return forward(arguments)


def main(arguments: List[str]) -> int:
    """Run, and turn every Stop into its sentence, its mend and its exit code."""
    try:
        return run(arguments)
    except Stop as stop:
        say("course: " + stop.sentence + ("\n    " + stop.mend if stop.mend else ""))
        return EXIT[stop.code]
    except KeyboardInterrupt:
        say("\ncourse: interrupted; the same command goes on where it stopped:\n    python3 " + quoted(this_command()))
        return EXIT["interrupted"]
    except OSError as error:
        if isinstance(error, FileNotFoundError) and error.filename == str(LOCK_FILE):
            say("course: uv.lock is missing from this copy of the course: get it again.\n    git checkout uv.lock")
            return EXIT["install"]
        place = Path(error.filename).parent if isinstance(error.filename, str) else ROOT
        if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)):
            stop = disk_full(ROOT, shutil.disk_usage(str(ROOT)).free)
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            stop = Stop(
                "folder",
                f"The folder {place} cannot be written: copy the course to a place of your own.",
                quoted(["cp", "-r", str(ROOT), str(Path.home() / ROOT.name)]),
            )
        else:
            raise
        say("course: " + stop.sentence + "\n    " + stop.mend)
        return EXIT[stop.code]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
