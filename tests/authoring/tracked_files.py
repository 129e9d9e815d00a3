"""The files of this copy of the course that git knows, and git itself, whatever a person has set for it."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
from pathlib import Path

__all__ = ["ROOT", "git", "tracked"]

ROOT = Path(__file__).parents[2]
OWN = {
    "GIT_CONFIG_GLOBAL": os.devnull,
    "GIT_CONFIG_NOSYSTEM": "1",
    **{f"GIT_{who}_{what}": "t@example.org" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")},
}
CALM = ("-c", "safe.directory=*", "-c", "core.quotePath=false", "-c", "core.autocrlf=false")


def git(folder: Path, *words: str) -> list[str]:
    """What a git command prints about the repository of a folder, line by line; an error where it fails."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    run = subprocess.run(
        ["git", *CALM, *words],
        cwd=folder,
        env=environment | OWN,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=True,
    )
    return run.stdout.splitlines()


@functools.cache
def tracked() -> tuple[Path, ...]:
    """The tracked files that are there; none where this is no checkout, or there is no git."""
    if not shutil.which("git") or not (ROOT / ".git").exists():
        return ()
    return tuple(path for path in (ROOT / name for name in git(ROOT, "ls-files")) if path.is_file())
