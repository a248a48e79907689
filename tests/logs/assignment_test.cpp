/// Columns are assigned by evidence: a table of tables under random names, and claims about single ones.
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <sstream>

#include "analysis/logs/read_log.h"
#include "nn/base/input_error.h"
#include "synthetic_header.h"

namespace swarmcert::tests {
namespace {

struct Tally {
  int right = 0, refused = 0, wrong = 0;
  std::string rows;
};

/// Reads the tables of `count` seeds. Wrong: a signal is used and differs from the flight. Refused: one that the table
/// has is not used.
Tally read_tables(std::uint32_t first, std::uint32_t count) {
  Tally tally;
  for (std::uint32_t seed = first; seed < first + count; ++seed) {
    const SyntheticTable table = synthetic_table(seed);
    Comparison comparison;
    std::string notes;
    try {
      std::istringstream in(table.text);
      const logs::Log log = logs::parse_log(in, "flight.csv");
      comparison = compared(table, log);
      notes = fmt::format("{}", fmt::join(log.interpretation, "\n      "));
    } catch (const files::InputError& error) {
      comparison.missing.emplace_back(error.what());
    }
    int& count_of = !comparison.wrong.empty()     ? tally.wrong
                    : !comparison.missing.empty() ? tally.refused
                                                  : tally.right;
    ++count_of;
    if (&count_of == &tally.right) continue;
    tally.rows += fmt::format("{}: wrong {}, not used {}\n    {}\n      {}\n", seed, comparison.wrong,
                              comparison.missing, table.habits, notes);
  }
  return tally;
}

void expect_nearly_all_right(std::uint32_t first, std::uint32_t count) {
  const Tally tally = read_tables(first, count);
  fmt::print("tables {}, right {}, not all used {}, wrong and silent {}\n{}", count, tally.right,
             tally.refused, tally.wrong, tally.rows);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.right, 0.95 * count);
}

TEST(Assignment, OfTablesUnderRandomNamesNoneIsReadWronglyAndNearlyAllAreReadWhole) {
  expect_nearly_all_right(1, 40);
}

TEST(Assignment, OfManyTablesUnderRandomNamesNoneIsReadWronglyAndNearlyAllAreReadWhole_slow) {
  expect_nearly_all_right(1, 400);
}

}  // namespace
}  // namespace swarmcert::tests
