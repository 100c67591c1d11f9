#!/usr/bin/env python3
"""Checks that each file includes what declares the names that it uses.

    scripts/check_needed_includes.py [ROOT]

A unity build does not notice that a source lacks an include if another source of
the same unit has it. This reads the text of the sources instead of compiling each
by itself, which takes seconds in place of minutes. It looks for two kinds of names,
and prints FILE:LINE: what for the first use of each that no included header, at any
depth, declares; exits 1 if there is any.
- Types, constants and functions at the outermost scope of one or more of our
  headers, unless the file itself declares the name.
- Names of the standard library in STANDARD.
"""

import functools
import pathlib
import re
import sys

FOLDERS = ("src", "tools", "tests", "bench")

# Header of the standard library -> names that it alone declares.
STANDARD = {
    "algorithm": "sort stable_sort nth_element lower_bound upper_bound clamp any_of "
                 "all_of none_of find_if count_if max_element min_element partition "
                 "unique reverse remove_if copy_if binary_search transform",
    "array": "array",
    "atomic": "atomic atomic_bool",
    "bit": "bit_cast bit_ceil bit_width countr_zero countl_zero popcount has_single_bit",
    "charconv": "from_chars to_chars",
    "chrono": "chrono",
    "cmath": "sqrt cos sin tan acos asin atan2 floor ceil lround llround hypot isfinite "
             "isnan cbrt exp log log2 pow nextafter",
    "condition_variable": "condition_variable",
    "cstdlib": "getenv abort",
    "cstring": "memcpy memset memcmp memmove strlen",
    "deque": "deque",
    "filesystem": "filesystem",
    "fstream": "ifstream ofstream fstream",
    "functional": "function reference_wrapper",
    "future": "future async promise",
    "iomanip": "setprecision setw",
    "limits": "numeric_limits",
    "list": "list",
    "map": "map multimap",
    "memory": "unique_ptr make_unique shared_ptr make_shared weak_ptr",
    "mutex": "mutex lock_guard unique_lock scoped_lock once_flag call_once",
    "numbers": "numbers",
    "numeric": "accumulate iota inner_product partial_sum reduce",
    "optional": "optional nullopt make_optional",
    "queue": "queue priority_queue",
    "random": "mt19937 mt19937_64 uniform_real_distribution",
    "set": "set multiset",
    "span": "span",
    "sstream": "ostringstream istringstream stringstream",
    "string": "string to_string stod stoi getline",
    "string_view": "string_view",
    "thread": "thread this_thread",
    "tuple": "tuple tie make_tuple",
    "unordered_map": "unordered_map",
    "unordered_set": "unordered_set",
    "variant": "variant visit holds_alternative get_if",
    "vector": "vector",
}
HEADER_OF = {name: header for header, names in STANDARD.items()
             for name in names.split()}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
# Comments, attributes, strings and characters.
NOT_CODE = re.compile(r'//[^\n]*|\[\[\w+\]\] ?|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"|'
                      r"(?<!\w)'(?:\\.|[^'\\\n])+'")
STANDARD_NAME = re.compile(r"\bstd::(\w+)")
# A name that nothing qualifies.
NAME = re.compile(r"(?<![\w.:>~])(?<!-)([A-Zk]\w+)\b")
# What a line at the outermost scope declares.
DECLARED = (
    re.compile(r"(?:friend )?(?:struct|class|enum class|enum|union|concept) (\w+)"),
    re.compile(r"template <typename (\w+)"),
    re.compile(r"#define (\w+)"),
    re.compile(r"using (?:[\w:]+::)?(\w+)(?: =|;)"),
    re.compile(r"(?:inline |static )*const(?:expr)? [^()]*?\b(k[A-Z]\w*)"),
    re.compile(r"(?!using|namespace|template|return|throw|else|case)[\w:]"
               r"[\w:<>,*& \[\]]*?[ >*&]([A-Z]\w*)\("),
    re.compile(r"([A-Z]\w*)\($"),
)


def code_of(text):
    """The text without what is no code; lines keep their numbers."""
    def newlines(match):
        return "\n" * match.group().count("\n")

    return NOT_CODE.sub(newlines, INCLUDE.sub(newlines, text))


def declared_in(lines):
    """The names that lines declare if they are at the outermost scope."""
    return {match.group(1) for line in lines
            for pattern in DECLARED if (match := pattern.match(line))}


class Tree:
    """The files below a root that may include one another."""

    def __init__(self, root):
        self.root = root
        self.text = {
            path.relative_to(root): path.read_text("utf-8")
            for folder in FOLDERS for pattern in ("*.h", "*.cpp")
            for path in sorted((root / folder).rglob(pattern))}
        self.code = {path: code_of(text) for path, text in self.text.items()}
        # At any scope: members too, whose classes are not told apart.
        self.declares = {
            path: declared_in(line.lstrip() for line in code.splitlines())
            for path, code in self.code.items()}
        self.headers_of = {}
        for path, code in self.code.items():
            if path.suffix == ".h" and path.parts[0] in ("src", "tools"):
                for name in declared_in(code.splitlines()):
                    self.headers_of.setdefault(name, set()).add(path)

    def resolve(self, header):
        """The path of an included header of ours, or None."""
        for path in (pathlib.PurePosixPath("src", header),
                     pathlib.PurePosixPath(header)):
            if pathlib.Path(path) in self.text:
                return pathlib.Path(path)
        return None

    @functools.cache
    def reach(self, path):
        """Our headers and the others that a file includes at any depth."""
        ours, others, new = {path}, set(), [path]
        while new:
            for _, header in INCLUDE.findall(self.text[new.pop()]):
                found = self.resolve(header)
                if found is None:
                    others.add(header)
                elif found not in ours:
                    ours.add(found)
                    new.append(found)
        return ours, others

    def lacking(self, path):
        """Yields (line number, name, header that would declare it)."""
        ours, others = self.reach(path)
        known = set().union(*(self.declares[header] for header in ours))
        seen = set()
        for number, line in enumerate(self.code[path].splitlines(), 1):
            for name in STANDARD_NAME.findall(line):
                header = HEADER_OF.get(name)
                if header and header not in others and name not in seen:
                    seen.add(name)
                    yield number, f"std::{name}", f"<{header}>"
            for name in NAME.findall(line):
                headers = self.headers_of.get(name)
                if headers and name not in known and name not in seen:
                    seen.add(name)
                    yield number, name, f'"{min(headers)}"'


def main():
    default = pathlib.Path(__file__).resolve().parent.parent
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else default
    tree = Tree(root)
    found = False
    for path in tree.text:
        for number, name, header in tree.lacking(path):
            print(f"{path}:{number}: {name} needs {header}")
            found = True
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
