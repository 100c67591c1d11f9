#!/usr/bin/env python3
"""The include rule: each layer includes only itself and the layers below it.

    scripts/check_includes.py [ROOT]

Prints one line per violation, as FILE:LINE: what, and exits 1 if there is any.
The folders inside src/solver follow the same rule; the files directly in
src/solver may include all of these folders. Other violations are an include of
oneTBB outside src/base/parallel.h, an include of the solver in tools/verify, a
project header in angle brackets or by a relative path, a source that is
included, a header without #pragma once, and a cycle of includes.
"""

import pathlib
import re
import sys

# Layer -> layers that it may include besides itself (docs/map.md).
ALLOWED = {
    "base": set(),
    "store": {"base"},
    "scene": {"base"},
    "partition": {"base", "scene"},
    "visibility": {"base", "scene", "partition"},
    "solver": {"base", "store", "scene", "partition", "visibility"},
}
# The folders of the solver; each may include itself and the folders before it
# in this list (docs/map.md).
SOLVER_FOLDERS = [
    "elements",
    "state",
    "transfer",
    "links",
    "refine",
    "paging",
    "solution",
    "residual",
    "reference",
]
EVERYTHING = set(ALLOWED) | {"tools"}
TBB_HEADER = pathlib.PurePosixPath("src/base/parallel.h")
# verify measures the solver's error, and must not share its way of sampling.
VERIFY = pathlib.PurePosixPath("tools/verify")
SOLVERS_OWN = ("solver/", "base/directions.h")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def layer_of(path):
    """The layer of a file by its path below the root."""
    return path.parts[1] if path.parts[0] == "src" else path.parts[0]


def allowed_layers(layer):
    """The layers that a file of `layer` may include."""
    if layer in ALLOWED:
        return ALLOWED[layer] | {layer}
    # Tools, tests and benchmarks may include all layers; benchmarks may also
    # include tests, whose models they share.
    return EVERYTHING | {layer} | ({"tests"} if layer == "bench" else set())


def includes_of(text):
    """Yields (line number, is_quoted, header) of each include."""
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if match:
            yield number, match.group(1) == '"', match.group(2)


def check_include(path, quoted, header):
    """Returns what is wrong with one include, or None."""
    first = header.split("/")[0]
    if first in ("tbb", "oneapi") and path != TBB_HEADER:
        return f"includes {header}; oneTBB belongs in {TBB_HEADER} alone"
    if not quoted:
        is_ours = first in EVERYTHING and header.endswith(".h")
        return f"<{header}> is ours and belongs in quotes" if is_ours else None
    if header.startswith(".") or "/" not in header:
        return f'"{header}" is not a path from the root'
    if not header.endswith(".h"):
        return f'"{header}" is no header'
    layer = layer_of(path)
    if first not in allowed_layers(layer):
        return f"{layer} must not include {header}"
    if VERIFY in path.parents and header.startswith(SOLVERS_OWN):
        return f"{VERIFY} must not share {header} with the solver"
    if layer == "solver" and first == "solver":
        return check_solver_folder(path, header)
    return None


def check_solver_folder(path, header):
    """Returns what is wrong with an include within the solver, or None."""
    own = path.parts[2]
    other = header.split("/")[1]
    if own not in SOLVER_FOLDERS:
        return None
    below = SOLVER_FOLDERS[: SOLVER_FOLDERS.index(own) + 1]
    return None if other in below else f"solver/{own} must not include {header}"


def source_files(root):
    """Yields the paths of the project's sources, relative to the root."""
    for folder in ("src", "tools", "tests", "bench"):
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                yield pathlib.PurePosixPath(path.relative_to(root))


def find_cycle(graph):
    """Returns a list of headers that include each other in a ring, or None."""
    done, stack = set(), []

    def visit(node):
        if node in done:
            return None
        if node in stack:
            return stack[stack.index(node):] + [node]
        stack.append(node)
        for other in graph.get(node, ()):
            ring = visit(other)
            if ring:
                return ring
        stack.pop()
        done.add(node)
        return None

    for node in sorted(graph):
        ring = visit(node)
        if ring:
            return ring
    return None


def check_tree(root):
    """All violations below the root, as printable lines."""
    problems, graph = [], {}
    for path in source_files(root):
        text = (root / path).read_text(encoding="utf-8")
        if path.suffix == ".h" and "#pragma once" not in text:
            problems.append(f"{path}:1: has no #pragma once")
        name = str(path.relative_to("src") if path.parts[0] == "src" else path)
        for number, quoted, header in includes_of(text):
            problem = check_include(path, quoted, header)
            if problem:
                problems.append(f"{path}:{number}: {problem}")
            if quoted:
                graph.setdefault(name, []).append(header)
    ring = find_cycle(graph)
    if ring:
        problems.append("includes run in a ring: " + " -> ".join(ring))
    return problems


def main():
    default = pathlib.Path(__file__).resolve().parent.parent
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else default
    if not any(source_files(root)):
        sys.exit(f"check_includes.py: no sources below {root}")
    problems = check_tree(root)
    for problem in problems:
        print(problem)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
