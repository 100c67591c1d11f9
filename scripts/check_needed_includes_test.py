#!/usr/bin/env python3
"""Tests that check_needed_includes.py sees what a file lacks, and only that."""

import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_needed_includes  # noqa: E402

HEADERS = {
    "src/base/a.h": "#include <vector>\n"
                    "struct Point {\n  double Length() const;\n};\n"
                    "constexpr int kMost = 3;\n"
                    "Point Middle(Point a, Point b);\n"
                    "#define CHECK(x) Check(x)\n",
    "src/base/b.h": '#include "base/a.h"\n',
}


class NeededIncludes(unittest.TestCase):
    def lacking(self, text):
        """The names that tools/c.cpp lacks if `text` is what it has."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, content in {**HEADERS, "tools/c.cpp": text}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(content, encoding="utf-8")
            tree = check_needed_includes.Tree(root)
            return [found[:2] for found in
                    tree.lacking(pathlib.Path("tools/c.cpp"))]

    def test_each_kind_of_name_is_seen_once_with_its_line(self):
        for line, name in (("Point p;", "Point"),
                           ("int i = kMost;", "kMost"),
                           ("auto p = Middle(a, b) * Middle(a, c);", "Middle"),
                           ("  CHECK(true);", "CHECK"),
                           ("std::vector<int> v;", "std::vector")):
            self.assertEqual(self.lacking(f"\n{line}\n"), [(2, name)])

    def test_an_include_at_any_depth_is_enough(self):
        self.assertEqual(
            self.lacking('#include "base/b.h"\n'
                         "std::vector<Point> v{Middle(a, b)};\n"), [])

    def test_names_that_a_file_declares_are_its_own(self):
        for declaration in ("class Point {};", "using Point = int;",
                            "using other::Point;", "  [[nodiscard]] int Point() const;",
                            "template <typename Point>", "friend class Point;"):
            self.assertEqual(self.lacking(f"{declaration}\nPoint p;\n"), [])

    def test_words_that_are_no_names_are_not_seen(self):
        for line in ("// Point", 'f("Point");', "a.Point", "a->Point", "b::Point",
                     "'P'", 'R"(\nPoint)"'):
            self.assertEqual(self.lacking(f"{line}\n"), [])

    def test_lines_after_an_include_and_a_raw_string_keep_their_numbers(self):
        self.assertEqual(
            self.lacking('#include <map>\nauto s = R"(\n\n)";\nPoint p;\n'),
            [(5, "Point")])


if __name__ == "__main__":
    unittest.main()
