"""What the outside programs share. Plain Python, but for `ply`, which needs numpy.

`from lib import np` is numpy, or a sentence that says how to get it."""

import importlib
import sys

INSTALL = "python3 -m pip install -r tests/outside/requirements.txt"


def __getattr__(name):
    if name != "np":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return importlib.import_module("numpy")
    except ModuleNotFoundError:
        sys.exit(f"{sys.argv[0]} needs numpy, which is not installed: {INSTALL}")
