#!/usr/bin/env python3
"""Reports unused names of sources, types of one name, and missing files.

    scripts/check_names.py [ROOT]

Prints one line per finding, as FILE:LINE: what, and exits 1 if there is any.
- Names that a .cpp file declares and never uses: using-declarations, aliases
  and constants at the scope of the file, and private members of classes. clang
  finds these only in a file that it compiles itself, and not in one that a
  unity build includes (scripts/lint).
- Types that two headers define under one name. A compiler does not see this if
  no source includes both headers.
- Files that a comment names and that do not exist.
"""

import collections
import pathlib
import re
import sys

FOLDERS = ("src", "tools", "tests", "bench")
COMMENT = re.compile(r"//.*")
NAME = re.compile(r"\b[A-Za-z_]\w*")
DECLARED = [
    (re.compile(r"using [\w:]+::(\w+);"), "using-declaration"),
    (re.compile(r"using (\w+) ="), "alias"),
    (re.compile(r"namespace (\w+) ="), "alias"),
    (re.compile(r"(?:static |inline )*const(?:expr)? .*?(k[A-Z]\w*)\b"),
     "constant"),
    (re.compile(r" +(?!return |delete |throw )[\w:][\w:<>,*& ]*[ >*&]"
                r"(\w+_)(?: =.*|\{.*|\[.*)?;"),
     "member"),
]


def unused_in(text):
    """Yields (line number, name, kind) of declared names that occur once."""
    lines = [COMMENT.sub("", line) for line in text.splitlines()]
    uses = collections.Counter(
        name for line in lines for name in NAME.findall(line))
    for number, line in enumerate(lines, 1):
        for pattern, kind in DECLARED:
            match = pattern.match(line)
            if match and uses[match.group(1)] == 1:
                yield number, match.group(1), kind


TYPE = re.compile(r"(?:struct|class|enum class|enum) (\w+)(?!::)\b[^;]*\{")


def types_defined_twice(root):
    """Yields (path, line number, name, the header that defines it too)."""
    first = {}
    for folder in ("src", "tools"):
        for path in sorted((root / folder).rglob("*.h")):
            for number, line in enumerate(
                    path.read_text("utf-8").splitlines(), 1):
                match = TYPE.match(line)
                if match is None:
                    continue
                other = first.setdefault(match.group(1), path)
                if other != path:
                    yield path, number, match.group(1), other


FILE = re.compile(r"[\w/-]+\.(?:h|cpp|py|md)\b")


def missing_files(root):
    """Yields (path, line number, missing file that a comment names)."""
    there = {path.name for path in root.rglob("*.*")
             if not path.is_relative_to(root / "build")}
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[hc]*")):
            for number, line in enumerate(
                    path.read_text("utf-8").splitlines(), 1):
                for comment in COMMENT.findall(line):
                    for name in FILE.findall(comment):
                        if pathlib.Path(name).name not in there:
                            yield path, number, name


def main():
    default = pathlib.Path(__file__).resolve().parent.parent
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else default
    found = False
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.cpp")):
            for number, name, kind in unused_in(path.read_text("utf-8")):
                print(f"{path.relative_to(root)}:{number}: "
                      f"{kind} {name} is not used")
                found = True
    for path, number, name, other in types_defined_twice(root):
        print(f"{path.relative_to(root)}:{number}: type {name} is also "
              f"defined in {other.relative_to(root)}")
        found = True
    for path, number, name in missing_files(root):
        print(f"{path.relative_to(root)}:{number}: there is no file {name}")
        found = True
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
