#include "nn/base/csv.h"

#include <gtest/gtest.h>

#include <cmath>

namespace swarmcert::files {
namespace {

using Cells = std::vector<std::string_view>;

TEST(Csv, TakesTheFirstUsualSeparatorOfALine) {
  EXPECT_EQ(csv_separator("a;b,c", ' '), ',') << "decimal commas are not supported";
  EXPECT_EQ(csv_separator("a;b\tc", ' '), ';');
  EXPECT_EQ(csv_separator("a\tb", ' '), '\t');
  EXPECT_EQ(csv_separator("a b", ' '), ' ');
}

TEST(Csv, CellsHaveNoBlanksAndQuotesAroundThemAndMayBeEmpty) {
  EXPECT_EQ(csv_cells(" a ,\"b c\",,d\r", ','), (Cells{"a", "b c", "", "d"}));
  EXPECT_EQ(csv_cells("a,", ','), (Cells{"a", ""}));
  EXPECT_EQ(csv_cells("", ','), Cells{""});
  EXPECT_EQ(csv_cells("  1   2 ", ' '), (Cells{"1", "2"})) << "runs of blanks count as one";
}

TEST(Csv, ANumberIsTheWholeCell) {
  double value = 0;
  EXPECT_TRUE(csv_number("+1.5e-3", value));
  EXPECT_EQ(value, 1.5e-3);
  EXPECT_TRUE(csv_number("nan", value));
  EXPECT_TRUE(std::isnan(value));
  EXPECT_TRUE(csv_number("1e999", value));
  EXPECT_TRUE(std::isinf(value));
  for (const char* const cell : {"", "+", "1 2", "1,5", "0x10", "1.5V"})
    EXPECT_FALSE(csv_number(cell, value)) << cell;
}

}  // namespace
}  // namespace swarmcert::files
