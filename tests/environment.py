"""Virtual environments with pinned packages, for the scripts in the folders beside this file."""

import os
import shutil
import subprocess
import sys
from pathlib import Path


def made(venv, *installs):
    """The Python of `venv`, in which pip was given each of `installs`. What it was given is written into the
    environment last: one that was never finished, or has other packages, is made anew.
    """
    python, marker = venv / "bin" / "python", venv / "complete"
    wanted = "".join(" ".join(arguments) + "\n" for arguments in installs)
    if not marker.exists() or marker.read_text() != wanted:
        shutil.rmtree(venv, ignore_errors=True)
        subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True)
        for arguments in installs:
            subprocess.run([str(python), "-m", "pip", "install", "--quiet", *arguments], check=True)
        marker.write_text(wanted)
    return python


def is_in(venv):
    return Path(sys.prefix).resolve() == venv.resolve()


def run_again(python):
    """Runs the script that is running with another Python, in its place."""
    if not python.exists():
        raise SystemExit(f"{python}: no such file")
    os.execv(python, [str(python), *sys.argv])


def enter(venv, *installs):
    """Runs this script again in the environment, once."""
    if not is_in(venv):
        run_again(made(venv, *installs))
