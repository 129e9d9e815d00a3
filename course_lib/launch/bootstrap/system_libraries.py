"""The Linux libraries of Open3D and VTK, and the sandbox of submitted notebooks: found missing, installed, or named."""

import ctypes
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import List, Sequence, Tuple

from . import places
from .messages import Stop, say
from .platform_facts import Facts

# What the wheels' shared objects name and do not bring (readelf -d over open3d and vtkmodules).
OPEN3D_NEEDS = {
    "x86_64": ["libusb-1.0.so.0", "libudev.so.1"],
    "aarch64": ["libgfortran.so.5"],
    "": ["libEGL.so.1", "libGL.so.1", "libX11.so.6", "libidn2.so.0", "libstdc++.so.6", "libgcc_s.so.1", "libz.so.1"],
}
# A row a library, and the sandbox: its package on Debian/Ubuntu (tried), Fedora, openSUSE, Arch (these three untested).
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
    "bwrap": ("bubblewrap", "bubblewrap", "bubblewrap", "bubblewrap"),
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


def library_command(missing: Sequence[str]) -> str:
    """The line that an administrator runs to install these libraries; "" where none is missing."""
    column, command = FAMILIES.get(linux_family(), FAMILIES["debian"])
    packages = sorted(set(" ".join(PACKAGES[name][column] for name in missing).split()))
    return as_administrator(f"{command} {' '.join(packages)}") if packages else ""


def is_administrator() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0


def as_administrator(command: str) -> str:
    return command if is_administrator() else f"sudo {command}"


def install_as_root(what: str, line: str) -> None:
    """Run the line of an administrator where this is one, on Debian or Ubuntu; elsewhere do nothing."""
    if linux_family() == "debian" and is_administrator() and shutil.which("apt-get"):
        say(f"Installing {what}: {line}")
        apt_get(line)


def ensure_sandbox(known: Facts) -> None:
    """Install bubblewrap, in which submitted notebooks run, as root on Debian or Ubuntu; elsewhere name the line."""
    if known.system != "Linux" or shutil.which("bwrap"):
        return
    line = library_command(["bwrap"])
    install_as_root("the sandbox of submitted notebooks", line)
    if not shutil.which("bwrap"):
        say(f"Submitted notebooks run in bubblewrap, which an administrator installs with this line:\n    {line}")


def ensure_libraries(known: Facts) -> None:
    """Install the Linux libraries as root on Debian or Ubuntu; elsewhere say what is missing and who can install it.

    Raises
    ------
    Stop
        If Open3D cannot load. Without a driver to draw with, only a remark is printed.
    """
    vital, drawing = missing_libraries(known)
    if vital or drawing:
        install_as_root("Linux libraries of Open3D and VTK", library_command(vital + drawing))
        vital, drawing = missing_libraries(known)
    line = library_command(vital + drawing)
    tried = "" if linux_family() == "debian" else " (untested on this Linux)"
    if vital:
        what = f"Open3D cannot load without {', '.join(vital)}"
        raise Stop("libraries", f"{what}; an administrator installs what is missing with this line{tried}:", line)
    if drawing:
        say("There is no driver to draw 3D with: everything works, with clouds and meshes drawn by matplotlib.")
        say(f"An administrator adds one with this line{tried}:\n    {line}")


def apt_get(command: str) -> None:
    """Run an apt-get line after `apt-get update`, asking nothing; what it says goes to .uv/apt.log."""
    environment = dict(os.environ, DEBIAN_FRONTEND="noninteractive")
    options = ["-o", "DPkg::Lock::Timeout=300", "-o", "APT::Sandbox::User=root", "-qq"]
    with open(str(places.PRIVATE / "apt.log"), "wb") as file:
        for words in (["apt-get", "update"], command.split()):
            words[1:1] = options
            subprocess.call(words, stdin=subprocess.DEVNULL, stdout=file, stderr=file, env=environment)
