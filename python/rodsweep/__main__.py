"""``python -m rodsweep``: the program, from the package."""

from __future__ import annotations

import os
import shutil
import signal
import sys

from ._rodsweep import program
from ._runtime import prepare


def main() -> int:
    """Runs the program with the arguments of this process; gives its exit code."""
    prepare()
    # The engine listens for Ctrl-C where it can finish a part; elsewhere the process ends.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    arguments = sys.argv[1:]
    if arguments[:2] == ["submit", "slurm"] and not any(word.split("=")[0] == "--program" for word in arguments):
        # Jobs call the command, not the interpreter that runs it now.
        found = shutil.which("rodsweep", path=os.path.dirname(sys.executable)) or shutil.which("rodsweep")
        if found is None:
            print("error: the command rodsweep is not on the PATH; give --program FILE", file=sys.stderr)
            return 2
        arguments += ["--program", found]
    sys.stdout.flush()
    return program(["rodsweep", *arguments])


if __name__ == "__main__":
    sys.exit(main())
