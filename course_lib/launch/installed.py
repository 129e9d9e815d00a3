"""Whether .venv holds exactly what uv.lock says: each package, its version, and every file that it brought."""

from __future__ import annotations

import csv
import importlib.metadata
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from packaging.markers import Marker, default_environment
from packaging.utils import canonicalize_name


def locked_versions(lock: str, environment: Mapping[str, str] | None = None) -> dict[str, str]:
    """The packages of uv.lock that belong on one machine, as {name: version}.

    Parameters
    ----------
    lock : the text of uv.lock.
    environment : marker values (sys_platform, python_full_version, ...) where they differ from the running Python's.

    Returns
    -------
    What the course's own dependencies and its default groups lead to; not the group `setup`, which is uv itself.
    """
    packages = tomllib.loads(lock)["package"]
    values: dict[str, Any] = {**default_environment(), **(environment or {})}
    course = next(package for package in packages if "virtual" in package["source"])
    groups = [group for name, group in course.get("dev-dependencies", {}).items() if name != "setup"]
    found: dict[str, str] = {}
    waiting = [course.get("dependencies", []), *groups]
    seen: set[tuple[str, str]] = set()
    while waiting:
        for wanted in waiting.pop():
            if "marker" in wanted and not Marker(wanted["marker"]).evaluate(values):
                continue
            package = _fitting(packages, wanted, values)
            found[package["name"]] = package["version"]
            for extra in ["", *wanted.get("extra", [])]:
                if (package["name"], extra) not in seen:
                    seen.add((package["name"], extra))
                    more = package.get("optional-dependencies", {}).get(extra, []) if extra else None
                    waiting.append(package.get("dependencies", []) if more is None else more)
    return found


def _fitting(packages: list[dict[str, Any]], wanted: dict[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """The entry that a dependency means; of several versions the one for this environment."""
    named = [one for one in packages if all(one[key] == wanted[key] for key in ("name", "version") if key in wanted)]
    for package in named:
        markers = package.get("resolution-markers", [])
        if not markers or any(Marker(marker).evaluate(dict(values)) for marker in markers):
            return package
    return named[0]


def _missing_files(distribution: importlib.metadata.Distribution) -> list[str]:
    """Files that a wheel brought and that are gone, or have lost their content."""
    lost = []
    # its list itself: `files` of newer Pythons leaves out what is gone
    for name, _, size in csv.reader((distribution.read_text("RECORD") or "").splitlines()):
        path = Path(str(distribution.locate_file(name)))
        if not name.endswith(".pyc") and (not path.is_file() or (size not in ("", "0") and path.stat().st_size == 0)):
            lost.append(name)
    return lost


def differences(wanted: Mapping[str, str], folders: Iterable[str] | None = None) -> list[str]:
    """What is missing, of another version, damaged, or too much, one short phrase each.

    Parameters
    ----------
    wanted : {name: version}, as `locked_versions` gives it.
    folders : where to look; sys.path where None.
    """
    where = {"path": list(folders)} if folders is not None else {}
    there = {canonicalize_name(one.metadata["Name"]): one for one in importlib.metadata.distributions(**where)}
    said = []
    for name, version in sorted(wanted.items()):
        if name not in there:
            said.append(f"{name} {version} is missing")
        elif there[name].version != version:
            said.append(f"{name} is {there[name].version}, not {version}")
        elif lost := _missing_files(there[name]):
            said.append(f"{name} has lost {len(lost)} of its files, such as {lost[0]}")
    return said + [f"{name} {there[name].version} is too much" for name in sorted(set(there) - set(wanted))]
