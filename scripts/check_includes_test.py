#!/usr/bin/env python3
"""Tests that check_includes.py reports every kind of violation."""

import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_includes  # noqa: E402


class IncludeRule(unittest.TestCase):
    def problems(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return check_includes.check_tree(root)

    def assert_one(self, files, place):
        problems = self.problems(files)
        self.assertEqual(len(problems), 1, problems)
        self.assertIn(place, problems[0])

    def test_downward_includes_are_allowed(self):
        files = {
            "src/base/a.h": "#pragma once\n#include <vector>\n",
            "src/scene/b.h": '#pragma once\n#include "base/a.h"\n',
            "tools/c.cpp": '#include "scene/b.h"\n',
        }
        self.assertEqual(self.problems(files), [])

    def test_upward_include_is_named_with_its_line(self):
        self.assert_one(
            {"src/base/a.cpp": '\n#include "scene/b.h"\n'}, "src/base/a.cpp:2:"
        )

    def test_geometry_does_not_know_the_store(self):
        for layer in ("scene", "partition", "visibility"):
            self.assert_one(
                {f"src/{layer}/a.cpp": '#include "store/b.h"\n'}, "store/b.h"
            )

    def test_layers_do_not_know_the_tools(self):
        self.assert_one(
            {"src/solver/a.cpp": '#include "tools/b.h"\n'}, "tools/b.h"
        )

    def test_verify_shares_no_sampling_with_the_solver(self):
        for header in ("solver/a.h", "base/directions.h"):
            self.assert_one(
                {"tools/verify/b.cpp": f'#include "{header}"\n'}, header
            )
        self.assertEqual(
            self.problems({"tools/b.cpp": '#include "solver/a.h"\n'}), []
        )

    def test_folders_of_the_solver_stand_on_those_before(self):
        self.assertEqual(
            self.problems(
                {
                    "src/solver/refine/a.cpp": '#include "solver/links/b.h"\n',
                    "src/solver/c.cpp": '#include "solver/refine/d.h"\n',
                }
            ),
            [],
        )
        for header in ("solver/refine/b.h", "solver/engine.h"):
            self.assert_one(
                {"src/solver/links/a.cpp": f'#include "{header}"\n'}, header
            )

    def test_tbb_is_behind_one_header(self):
        self.assert_one(
            {"src/solver/a.cpp": "#include <tbb/task.h>\n"}, "tbb/task.h"
        )
        self.assertEqual(
            self.problems(
                {"src/base/parallel.h": "#pragma once\n#include <tbb/t.h>\n"}
            ),
            [],
        )

    def test_angle_brackets_do_not_evade_the_rule(self):
        self.assert_one(
            {"src/base/a.cpp": "#include <scene/b.h>\n"}, "scene/b.h"
        )

    def test_relative_path_does_not_evade_the_rule(self):
        self.assert_one(
            {"src/base/a.cpp": '#include "../scene/b.h"\n'}, "../scene/b.h"
        )

    def test_included_source_is_named(self):
        self.assert_one(
            {"src/base/a.cpp": '#include "base/b.cpp"\n'}, "base/b.cpp"
        )

    def test_header_without_guard_is_named(self):
        self.assert_one({"src/base/a.h": "int x;\n"}, "src/base/a.h:1:")

    def test_ring_of_includes_is_named(self):
        self.assert_one(
            {
                "src/base/a.h": '#pragma once\n#include "base/b.h"\n',
                "src/base/b.h": '#pragma once\n#include "base/a.h"\n',
            },
            "base/a.h -> base/b.h -> base/a.h",
        )


if __name__ == "__main__":
    unittest.main()
