"""course.py: the Linux libraries that Open3D and VTK need, found missing before anything imports them."""

from __future__ import annotations

import importlib.util
import mmap
import sys
from pathlib import Path

import pytest

from course_lib.launch.bootstrap import messages, platform_facts, system_libraries

LINUX = platform_facts.Facts((3, 12, 4), 64, "Linux", "x86_64", ("glibc", (2, 36)))


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A pretended Linux: what it lacks, who asks, and the commands that were run."""

    class Machine:
        lacks: set[str] = set()
        draws = True
        root = False
        family = "debian"
        apt_mends = True
        ran: list[str] = []

    pretended = Machine()
    pretended.ran = []

    def apt_get(command):
        pretended.ran.append(command)
        if pretended.apt_mends:
            pretended.lacks, pretended.draws = set(), True

    monkeypatch.setattr(system_libraries, "loads", lambda library: library not in pretended.lacks)
    monkeypatch.setattr(system_libraries, "draws", lambda: pretended.draws)
    monkeypatch.setattr(system_libraries, "is_administrator", lambda: pretended.root)
    monkeypatch.setattr(system_libraries, "linux_family", lambda: pretended.family)
    monkeypatch.setattr(system_libraries, "apt_get", apt_get)
    monkeypatch.setattr(system_libraries.shutil, "which", lambda name: f"/usr/bin/{name}")
    return pretended


def test_where_all_is_there_nothing_is_run_or_said(machine, capsys):
    machine.root = True
    system_libraries.ensure_libraries(LINUX)
    assert machine.ran == [] and capsys.readouterr().err == ""


def test_root_on_debian_installs_what_is_missing_and_says_so(machine, capsys):
    machine.root, machine.lacks = True, {"libusb-1.0.so.0", "libGL.so.1"}
    system_libraries.ensure_libraries(LINUX)
    assert machine.ran == ["apt-get install -y --no-install-recommends libgl1 libusb-1.0-0"]
    assert "Installing Linux libraries" in capsys.readouterr().err


def test_root_whose_apt_fails_is_stopped_with_the_line(machine):
    machine.root, machine.lacks, machine.apt_mends = True, {"libEGL.so.1"}, False
    with pytest.raises(messages.Stop) as stopped:
        system_libraries.ensure_libraries(LINUX)
    assert stopped.value.code == "libraries" and stopped.value.mend.endswith("libegl1")


def test_without_root_open3d_cannot_load_and_the_administrator_gets_the_line(machine):
    machine.lacks = {"libusb-1.0.so.0", "libX11.so.6"}
    with pytest.raises(messages.Stop) as stopped:
        system_libraries.ensure_libraries(LINUX)
    assert "Open3D cannot load without libusb-1.0.so.0, libX11.so.6" in stopped.value.sentence
    assert stopped.value.mend == "sudo apt-get install -y --no-install-recommends libusb-1.0-0 libx11-6"
    assert machine.ran == [] and messages.EXIT[stopped.value.code] == 17


def test_without_a_driver_it_goes_on_and_says_what_still_works(machine, capsys):
    machine.draws = False
    system_libraries.ensure_libraries(LINUX)
    said = capsys.readouterr().err
    assert "matplotlib" in said and "sudo apt-get install" in said and "libegl-mesa0" in said


@pytest.mark.parametrize(
    ("family", "command"), [("fedora", "sudo dnf install -y libusb1"), ("arch", "sudo pacman -S --needed libusb")]
)
def test_other_linuxes_get_their_own_line_called_untested(machine, family, command):
    machine.family, machine.lacks = family, {"libusb-1.0.so.0"}
    with pytest.raises(messages.Stop) as stopped:
        system_libraries.ensure_libraries(LINUX)
    assert stopped.value.mend == command and "untested" in stopped.value.sentence


def test_every_needed_library_has_a_package_everywhere():
    needed = {name for names in system_libraries.OPEN3D_NEEDS.values() for name in names}
    assert needed < set(system_libraries.PACKAGES)
    assert all(
        len(names) == len(system_libraries.FAMILIES) and all(names) for names in system_libraries.PACKAGES.values()
    )


def test_other_systems_need_none():
    assert system_libraries.missing_libraries(platform_facts.Facts((3, 12, 0), 64, "Darwin", "arm64")) == ([], [])


def test_the_probe_tells_a_library_from_none():
    assert not system_libraries.loads("libnothing-of-this-name.so.9")
    if sys.platform.startswith("linux"):
        assert system_libraries.loads("libc.so.6")


def test_drawing_follows_the_drivers_that_glvnd_names(monkeypatch, tmp_path):
    monkeypatch.setattr(system_libraries, "loads", lambda library: library == "libEGL_there.so.0")
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_DIRS", str(tmp_path))
    assert not system_libraries.draws()
    (tmp_path / "10_gone.json").write_text('{"ICD": {"library_path": "libEGL_gone.so.0"}}', encoding="utf-8")
    assert not system_libraries.draws()
    (tmp_path / "50_there.json").write_text('{"ICD": {"library_path": "libEGL_there.so.0"}}', encoding="utf-8")
    assert system_libraries.draws()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="shared objects of Linux")
def test_the_list_covers_what_open3d_itself_names():
    """Nothing is on the list that no library of the wheel names (a name ends with a zero byte in an ELF file)."""
    folder = Path(importlib.util.find_spec("open3d").origin).parent
    listed = set(
        system_libraries.OPEN3D_NEEDS[""] + system_libraries.OPEN3D_NEEDS.get(platform_facts.facts().machine, [])
    )
    listed.remove("libz.so.1")  # Pillow, OpenCV and SciPy name it
    for path in folder.glob("*.so*"):
        with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            listed -= {name for name in listed if content.find(name.encode() + b"\0") >= 0}
    assert listed == set()


@pytest.mark.parametrize(
    ("text", "family"),
    [
        ('ID=debian\nVERSION_ID="12"\n', "debian"),
        ('NAME="Ubuntu"\nID=ubuntu\nID_LIKE=debian\n', "debian"),
        ("ID=linuxmint\nID_LIKE=ubuntu\n", "debian"),
        ('ID="rocky"\nID_LIKE="rhel centos fedora"\n', "fedora"),
        ('ID="opensuse-tumbleweed"\nID_LIKE="opensuse suse"\n', "suse"),
        ("ID=manjaro\nID_LIKE=arch\n", "arch"),
        ("ID=nixos\n", ""),
    ],
)
def test_families_of_linux_are_read_from_os_release(monkeypatch, text, family):
    monkeypatch.setattr(system_libraries.Path, "read_text", lambda self, **options: text)
    assert system_libraries.linux_family() == family
