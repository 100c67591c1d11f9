#!/usr/bin/env python3
"""Reports sources that docs/map.md does not name, and links that lead nowhere.

    scripts/check_docs.py [ROOT]

Prints one line per finding, as FILE:LINE: what, and exits 1 if there is any.
- The map's tables below a heading "Inside `FOLDER`" name the sources of that
  folder without their endings, in the first column. A row whose first column is
  bold begins the sources of the folder that it names, or, if it names none,
  those at the top. Every .h and .cpp file below the folder is named, and every
  name is that of a file.
- Links of Markdown files to files of the tree and to headings lead there.
"""

import pathlib
import re
import sys

HEADING = re.compile(r"#+ +(.*)")
SECTION = re.compile(r"## Inside `([\w/]+)`")
QUOTED = re.compile(r"`([^`]+)`")
LINK = re.compile(r"\]\(([^()\s]+)\)")
CODE = re.compile(r"`[^`]*`")


def named_in(text):
    """Yields (line number, folder, name) of each source that the map names."""
    top = folder = None
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("#"):
            section = SECTION.match(line)
            top = folder = section.group(1) if section else None
        elif top is not None and line.startswith("| "):
            first = line.split("|")[1].strip()
            names = QUOTED.findall(first)
            if not first.startswith("**"):
                for name in names:
                    yield number, folder, name
            else:
                folder = f"{top}/{names[0].strip('/')}" if names else top


def check_map(root):
    """All that is wrong with the map, as printable lines."""
    path = root / "docs/map.md"
    problems, named = [], set()
    for number, folder, name in named_in(path.read_text("utf-8")):
        named.add((folder, name))
        if not any((root / folder / f"{name}.{ending}").exists()
                   for ending in ("h", "cpp")):
            problems.append(f"docs/map.md:{number}: there is no source {name} "
                            f"in {folder}")
    sources = {path.relative_to(root) for top in ("src", "tools")
               for path in (root / top).rglob("*") if path.suffix in (".h", ".cpp")}
    for folder, name in sorted({(str(s.parent), s.stem) for s in sources} - named):
        problems.append(f"docs/map.md:1: does not name {name} of {folder}")
    return problems


def lines_of(text):
    """Yields (line number, line) of what is not an indented block of code."""
    for number, line in enumerate(text.splitlines(), 1):
        if not line.startswith("    "):
            yield number, line


def anchors_of(text):
    """The names by which links lead to the headings of a text."""
    anchors = set()
    for _, line in lines_of(text):
        heading = HEADING.match(line)
        if heading:
            words = re.sub(r"[^\w\- ]", "", heading.group(1).lower())
            anchors.add(words.strip().replace(" ", "-"))
    return anchors


def check_links(root):
    """All links that lead nowhere, as printable lines."""
    problems = []
    for path in sorted(root.rglob("*.md")):
        if path.is_relative_to(root / "build"):
            continue
        for number, line in lines_of(path.read_text("utf-8")):
            for link in LINK.findall(CODE.sub("", line)):
                file, _, anchor = link.partition("#")
                target = path.parent / file if file else path
                if "://" in link:
                    continue
                if not target.exists() or (
                        anchor and anchor not in anchors_of(
                            target.read_text("utf-8"))):
                    problems.append(f"{path.relative_to(root)}:{number}: "
                                    f"the link {link} leads nowhere")
    return problems


def main():
    default = pathlib.Path(__file__).resolve().parent.parent
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else default
    problems = check_map(root) + check_links(root)
    for problem in problems:
        print(problem)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
