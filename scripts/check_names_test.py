#!/usr/bin/env python3
"""Tests that check_names.py reports every kind of unused name and no used one,
two types of one name, and missing files.
"""

import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_names  # noqa: E402


class UnusedNames(unittest.TestCase):
    def assert_kinds(self, text, kinds):
        found = [kind for _, _, kind in check_names.unused_in(text)]
        self.assertEqual(found, kinds, text)

    def test_each_kind_is_seen(self):
        for text, kind in (
            ("using std::vector;\n", "using-declaration"),
            ("using Clock = std::chrono::steady_clock;\n", "alias"),
            ("namespace fs = std::filesystem;\n", "alias"),
            ("constexpr double kMost = 3;\n", "constant"),
            ("inline constexpr std::array<int, 2> kPair = {1, 2};\n",
             "constant"),
            ("class A {\n  int size_ = 0;\n};\n", "member"),
            ("class A {\n  const B* owner_;\n};\n", "member"),
        ):
            self.assert_kinds(text, [kind])

    def test_used_names_are_not(self):
        for text in (
            "using std::vector;\nvector<int> v;\n",
            "constexpr double kMost = 3;\ndouble x = kMost;\n",
            "class A {\n  int Size() { return size_; }\n  int size_ = 0;\n};\n",
        ):
            self.assert_kinds(text, [])

    def test_a_comment_is_no_use(self):
        self.assert_kinds("// kMost\nconstexpr int kMost = 3;\n", ["constant"])

    def test_the_line_is_told(self):
        found = list(check_names.unused_in("\n\nconstexpr int kMost = 3;\n"))
        self.assertEqual(found, [(3, "kMost", "constant")])


class TypesDefinedTwice(unittest.TestCase):
    def twice(self, one, other):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in (("a.h", one), ("b.h", other)):
                (root / "src" / name[0]).mkdir(parents=True)
                (root / "src" / name[0] / name).write_text(text, "utf-8")
            return [(path.name, number, name, first.name) for
                    path, number, name, first in
                    check_names.types_defined_twice(root)]

    def test_two_definitions_are_seen(self):
        for kind in ("struct", "class", "enum class"):
            text = f"{kind} Frame {{\n}};\n"
            self.assertEqual(self.twice(text, "\n" + text),
                             [("b.h", 2, "Frame", "a.h")])

    def test_declarations_and_nested_types_are_not(self):
        for other in ("struct Frame;\n",
                      "struct Frame::Part {\n};\n",
                      "struct Frames {\n};\n",
                      "  struct Frame {\n  };\n"):
            self.assertEqual(self.twice("struct Frame {\n};\n", other), [])


class MissingFiles(unittest.TestCase):
    def test_comments_name_files_that_are_there(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "src").mkdir()
            (root / "src" / "a.h").write_text(
                "// See a.h and docs/gone.md.\n"
                'const char* name = "gone.h";\n'
                "int x;  // as in b/gone.h\n", "utf-8")
            found = [(path.name, number, name) for path, number, name in
                     check_names.missing_files(root)]
        self.assertEqual(found, [("a.h", 1, "docs/gone.md"),
                                 ("a.h", 3, "b/gone.h")])


if __name__ == "__main__":
    unittest.main()
