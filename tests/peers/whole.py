"""Files that appear whole or not at all.

>>> import tempfile
>>> with tempfile.TemporaryDirectory() as folder:
...     path = Path(folder) / "a.txt"
...     try:
...         with writing(path) as file:
...             _ = file.write("half")
...             raise KeyError
...     except KeyError:
...         pass
...     print(sorted(Path(folder).iterdir()))
[]
"""

import contextlib
import os
from pathlib import Path

import numpy as np


@contextlib.contextmanager
def writing(path, mode="w"):
    """A file to write to that takes its name when the block ends without an error."""
    path = Path(path)
    part = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        with open(part, mode, newline="" if mode == "w" else None) as file:
            yield file
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def save(path, **arrays):
    """An NPZ file."""
    with writing(path, "wb") as file:
        np.savez_compressed(file, **arrays)
