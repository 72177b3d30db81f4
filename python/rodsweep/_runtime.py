"""What must stand before Vulkan is started."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile


def prepare() -> None:
    """Sets ``XDG_RUNTIME_DIR`` for this process where it is not set: to an empty private folder that goes at the end.

    Without it Mesa's drivers write a line on the standard error each time they are asked, in notebooks too.
    """
    if "XDG_RUNTIME_DIR" in os.environ or sys.platform in ("win32", "darwin"):
        return
    try:
        folder = tempfile.mkdtemp(prefix="rodsweep-")
    except OSError:
        return
    os.environ["XDG_RUNTIME_DIR"] = folder
    owner = os.getpid()

    def remove() -> None:
        # A forked child leaves it to its parent.
        if os.getpid() == owner:
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
