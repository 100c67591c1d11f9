#!/usr/bin/env python3
"""Has the compiler check each source of some folders by itself.

    scripts/parse_alone.py BUILD FOLDER...

Checks all sources below the FOLDERs by the commands of BUILD, without making
code. A unity build does not notice that a source lacks an include if another
source of the same unit has it. Exits 1 if the compiler refuses a source.
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
    """Whether the compiler accepts the source of a compile command."""
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
