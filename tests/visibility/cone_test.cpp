#include "visibility/cone.h"

#include "base/random.h"

#include <cmath>
#include <memory>
#include <vector>

#include <glpk.h>
#include <gtest/gtest.h>

namespace enfilade {
namespace {

PluckerRow RandomRow(Random& random) {
  PluckerRow row{};
  double square = 0;
  do {
    square = 0;
    for (double& x : row) {
      x = 2 * random.Next() - 1;
      square += x * x;
    }
  } while (square < 0.01 || square > 1);
  for (double& x : row) {
    x /= std::sqrt(square);
  }
  return row;
}

double LeastSide(const std::vector<PluckerRow>& rows, const PluckerRow& x) {
  double least = 1e30;
  for (const PluckerRow& row : rows) {
    least = std::min(least, Dot(row, x));
  }
  return least;
}

// The largest t with a . x >= t for all rows and |x_k| <= 1, by GLPK.
double LargestMargin(const std::vector<PluckerRow>& rows) {
  glp_term_out(GLP_OFF);
  const std::unique_ptr<glp_prob, decltype(&glp_delete_prob)> lp(
      glp_create_prob(), &glp_delete_prob);
  glp_set_obj_dir(lp.get(), GLP_MAX);
  glp_add_cols(lp.get(), 7);
  for (int k = 1; k <= 6; ++k) {
    glp_set_col_bnds(lp.get(), k, GLP_DB, -1, 1);
  }
  glp_set_col_bnds(lp.get(), 7, GLP_DB, -10, 10);
  glp_set_obj_coef(lp.get(), 7, 1);
  const std::array<int, 8> columns = {0, 1, 2, 3, 4, 5, 6, 7};
  for (const PluckerRow& row : rows) {
    const int r = glp_add_rows(lp.get(), 1);
    std::array<double, 8> values{};
    std::copy(row.begin(), row.end(), values.begin() + 1);
    values[7] = -1;
    glp_set_row_bnds(lp.get(), r, GLP_LO, 0, 0);
    glp_set_mat_row(lp.get(), r, 7, columns.data(), values.data());
  }
  EXPECT_EQ(glp_simplex(lp.get(), nullptr), 0);
  return glp_get_obj_val(lp.get());
}

TEST(InteriorOfCone, AgreesWithGlpkOnRandomRows) {
  Random random(1);
  int open = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<PluckerRow> rows(1 + random.NextBelow(24));
    for (PluckerRow& row : rows) {
      row = RandomRow(random);
    }
    const auto found = InteriorOfCone(rows);
    ASSERT_EQ(found.has_value(), LargestMargin(rows) > 1e-6) << "system " << i;
    if (found) {
      ++open;
      EXPECT_GT(LeastSide(rows, *found), 0);
    }
  }
  EXPECT_GT(open, 500);
  EXPECT_LT(open, 1500);
}

// A hidden vector satisfies the rows by a little: narrow cones are found.
TEST(InteriorOfCone, FindsNarrowCones) {
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const PluckerRow hidden = RandomRow(random);
    std::vector<PluckerRow> rows;
    while (rows.size() < 40) {
      PluckerRow row = RandomRow(random);
      const double side = Dot(row, hidden);
      for (size_t k = 0; k < 6; ++k) {
        row[k] += (1e-5 - side) * hidden[k];
      }
      const double length = std::sqrt(Dot(row, row));
      for (double& x : row) {
        x /= length;
      }
      rows.push_back(row);
    }
    EXPECT_TRUE(InteriorOfCone(rows)) << "system " << i;
  }
}

TEST(InteriorOfCone, OppositeRowsLeaveNothing) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const PluckerRow a = RandomRow(random);
    PluckerRow b = a;
    for (double& x : b) {
      x = -x;
    }
    const std::vector<PluckerRow> rows = {a, RandomRow(random), b};
    EXPECT_FALSE(InteriorOfCone(rows));
  }
}

TEST(EdgeRow, LineAlongTheNormalPassesCounterClockwiseEdgesOnTheLeft) {
  const std::array<Point3, 4> square = {
      Point3{1, -1, 5}, Point3{1, 1, 5}, Point3{-1, 1, 5}, Point3{-1, -1, 5}};
  const Point3 o{0.3, 0.2, 0};
  const Vec3 d{0.01, 0.02, 1};
  const Vec3 m = Cross(o - Point3{}, d);
  const PluckerRow line = {d.x, d.y, d.z, m.x, m.y, m.z};
  const Vec3 outside = Cross(Vec3{2, 0, 0}, d);
  const PluckerRow beside = {d.x, d.y, d.z, outside.x, outside.y, outside.z};
  int passed_beside = 0;
  for (size_t i = 0; i < 4; ++i) {
    const PluckerRow row = EdgeRow(square[i], square[(i + 1) % 4]);
    EXPECT_GT(Dot(row, line), 0);
    passed_beside += Dot(row, beside) > 0 ? 1 : 0;
  }
  EXPECT_EQ(passed_beside, 3);
}

}  // namespace
}  // namespace enfilade
