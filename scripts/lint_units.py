#!/usr/bin/env python3
"""Prints the units of a build by which clang-tidy sees every source once.

    scripts/lint_units.py BUILD

Prints the paths of the unity files of BUILD and of the sources that BUILD
compiles by themselves, one per line. The largest come first, so that no large
unit runs alone at the end. Exits 1 if BUILD has no compile commands or if its
sources are not those of the tree.
"""

import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^#include "(.*\.cpp)"$', re.MULTILINE)


def sources_of(unit):
    """The sources that a unit consists of."""
    if unit.suffix == ".cpp":
        return [unit]
    text = unit.read_text(encoding="utf-8")
    return [pathlib.Path(name) for name in INCLUDE.findall(text)]


def main():
    commands = pathlib.Path(sys.argv[1]) / "compile_commands.json"
    if not commands.exists():
        sys.exit(f"lint: there is no {commands}: run `cmake --preset lint` first")
    entries = json.loads(commands.read_text(encoding="utf-8"))
    units = {pathlib.Path(entry["file"]) for entry in entries}
    sources = {unit: sources_of(unit) for unit in units}
    seen = {source for group in sources.values() for source in group}
    there = {source for folder in ("src", "tools", "tests", "bench")
             for source in (ROOT / folder).rglob("*.cpp")}
    for source in sorted(seen ^ there):
        sys.exit(f"lint: {source} is only one of in {commands} and in the tree: "
                 "run `cmake --preset lint` again")
    size = {unit: sum(source.stat().st_size for source in group)
            for unit, group in sources.items()}
    for unit in sorted(units, key=lambda unit: (-size[unit], unit)):
        print(unit)


if __name__ == "__main__":
    main()
