#!/usr/bin/env python3
"""Tests that check_docs.py reports sources that the map lacks, names of none,
and links that lead nowhere.
"""

import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_docs  # noqa: E402

MAP = """# Map
| `other` | not of a section |

## Inside `src`

| file | role |
|---|---|
| **`base/`** | **all** |
| `vec`, `ids` | `roles` are not read |

## Inside `src/solver`

| **`links/`** | **links** |
| `gather` | |
| **at the top** | **the loop** |
| `solve` | |
"""


def tree(folder, files):
    root = pathlib.Path(folder)
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


class TheMap(unittest.TestCase):
    def problems(self, sources):
        with tempfile.TemporaryDirectory() as folder:
            files = {name: "" for name in sources}
            return check_docs.check_map(
                tree(folder, {"docs/map.md": MAP, **files}))

    WHOLE = ("src/base/vec.h", "src/base/ids.cpp", "src/solver/links/gather.h",
             "src/solver/solve.h", "src/solver/solve.cpp")

    def test_a_whole_map_is_right(self):
        self.assertEqual(self.problems(self.WHOLE), [])

    def test_a_source_that_it_lacks_is_told(self):
        self.assertEqual(
            self.problems((*self.WHOLE, "src/solver/links/vec.cpp")),
            ["docs/map.md:1: does not name vec of src/solver/links"])

    def test_a_name_without_a_source_is_told(self):
        self.assertEqual(
            self.problems(self.WHOLE[:2] + self.WHOLE[3:]),
            ["docs/map.md:14: there is no source gather in src/solver/links"])


class Links(unittest.TestCase):
    def problems(self, text):
        with tempfile.TemporaryDirectory() as folder:
            return check_docs.check_links(tree(folder, {
                "docs/a.md": text,
                "docs/b.md": "# B\n\n## What `solve` reads, and when\n"}))

    def test_links_that_lead_somewhere_are_right(self):
        self.assertEqual(
            self.problems("# A b\n[1](b.md) [2](b.md#what-solve-reads-and-when)\n"
                          "[3](#a-b) [4](https://x.org/y)\n    [5](code.md)\n"
                          "`[6](code.md)`\n"), [])

    def test_missing_files_and_headings_are_told(self):
        for link in ("c.md", "b.md#gone", "#gone", "../b.md"):
            self.assertEqual(
                self.problems(f"\n[x]({link})\n"),
                [f"docs/a.md:2: the link {link} leads nowhere"])


if __name__ == "__main__":
    unittest.main()
