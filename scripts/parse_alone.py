#!/usr/bin/env python3
"""Shows the compiler each source of some folders by itself, without making code.

    scripts/parse_alone.py BUILD FOLDER...

By the commands of BUILD, of all sources below the FOLDERs. A unity build does not
see that a source lacks an include which another one of its unit has. Exits 1 if
a source is refused.
"""

import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def parse(entry):
    """Whether the compiler takes the source of a compile command."""
    words = shlex.split(entry["command"])
    at = words.index("-o")
    words[at:at + 2] = ["-fsyntax-only"]
    return subprocess.run(words, cwd=entry["directory"]).returncode == 0


def main():
    commands = pathlib.Path(sys.argv[1]) / "compile_commands.json"
    folders = [ROOT / name for name in sys.argv[2:]]
    entries = [entry for entry in json.loads(commands.read_text("utf-8"))
               if any(folder in pathlib.Path(entry["file"]).parents
                      for folder in folders)]
    if not entries:
        sys.exit(f"parse_alone: {commands} has no source below {sys.argv[2:]}")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        taken = list(pool.map(parse, entries))
    print(f"parsed {len(taken)} sources by themselves, "
          f"{taken.count(False)} refused")
    sys.exit(0 if all(taken) else 1)


if __name__ == "__main__":
    main()
