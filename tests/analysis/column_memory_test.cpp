/// Columns kept between passes do not change any result.
#include "analysis/identification/column_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "analysis/identification/diagnose.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"

namespace swarmcert::tests {
namespace {

using identification::Candidate;
using identification::ColumnMemory;
using identification::Grams;
using identification::Kept;
using identification::Passes;

/// Two flights of two vehicles.
class Remembered : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) / ("memory-" + std::to_string(getpid()));
    for (int run = 0; run < 2; ++run)
      fly({}, {Program::kRich, 2, 20, static_cast<std::uint64_t>(run)}, folder_.string(), run);
    residuals::InputArguments arguments;
    arguments.models = {source_path("stability/models/crazyflie-small.toml")};
    arguments.flights = {folder_.string()};
    inputs_ = residuals::read_inputs(arguments);
    covered_ = identification::coverage(inputs_, "small", identification::every_flight(inputs_), 2);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Passes passes(std::shared_ptr<ColumnMemory> memory, int jobs = 2) const {
    return {inputs_,         "small", identification::every_flight(inputs_), covered_.records, jobs,
            [](int, int) {}, memory};
  }

  Candidate candidate(const std::string& name) const {
    return identification::candidate(name, inputs_.models[0], covered_);
  }

  /// Requests as made by a selection and its refinement: all candidates, some of them, one off the grid, all
  /// including it.
  std::vector<std::pair<std::vector<Candidate>, Kept>> requests() const {
    std::vector<Candidate> all = identification::all_candidates(inputs_.models[0], covered_);
    std::vector<Candidate> some = {candidate("downwash"), candidate("vehicle_offset"),
                                   candidate("drag_linear")};
    some[0].thetas = {some[0].thetas[0]};
    std::vector<Candidate> moved = some;
    moved[0].thetas[0][0] *= 1.01;
    std::vector<Candidate> again = all;
    again.push_back(moved[0]);
    return {
        {all, Kept::kYes}, {some, Kept::kNo}, {moved, Kept::kNo}, {again, Kept::kYes}, {moved, Kept::kNo}};
  }

  std::filesystem::path folder_;
  residuals::Inputs inputs_;
  identification::Coverage covered_;
};

void expect_alike(const Grams& kept, const Grams& anew) {
  ASSERT_EQ(kept.blocks.size(), anew.blocks.size());
  ASSERT_EQ(kept.columns, anew.columns);
  ASSERT_GT(anew.blocks.size(), 20u);
  for (std::size_t b = 0; b < anew.blocks.size(); ++b) {
    const identification::Block &one = kept.blocks[b], &other = anew.blocks[b];
    EXPECT_TRUE(one.gram.isApprox(other.gram, 1e-12)) << b;
    EXPECT_TRUE(one.b.isApprox(other.b, 1e-10)) << b;
    EXPECT_NEAR(one.y, other.y, 1e-12 * other.y);
    EXPECT_EQ(one.records, other.records);
    EXPECT_EQ(one.flight, other.flight);
    EXPECT_EQ(one.follows, other.follows);
  }
  for (std::size_t k = 0; k < anew.support.size(); ++k) {
    for (std::size_t t = 0; t < anew.support[k].size(); ++t) {
      EXPECT_EQ(kept.support[k][t].records, anew.support[k][t].records) << anew.candidates[k].name;
      EXPECT_EQ(kept.support[k][t].blocks, anew.support[k][t].blocks) << anew.candidates[k].name;
      EXPECT_EQ(kept.support[k][t].flights, anew.support[k][t].flights) << anew.candidates[k].name;
    }
  }
}

TEST_F(Remembered, GramsAreThoseOfAPassWithoutMemoryWhateverWasAskedBefore) {
  // With memory for everything, for the first request only, and for nothing.
  const std::size_t column_bytes = 3 * sizeof(double) * covered_.records;
  const int columns = identification::columns_of(requests()[0].first).columns;
  for (const std::size_t room :
       {ColumnMemory::kMost_bytes, column_bytes * static_cast<std::size_t>(columns), std::size_t{1}}) {
    const auto memory = std::make_shared<ColumnMemory>(2, covered_.records, room);
    for (const auto& [candidates, kept] : requests())
      expect_alike(block_grams(passes(memory), candidates, kept), block_grams(passes(nullptr), candidates));
  }
}

TEST_F(Remembered, GramsAreTheSameBitsOnAnyNumberOfThreads) {
  std::vector<Grams> results;
  for (const int jobs : {1, 4}) {
    const auto memory = std::make_shared<ColumnMemory>(2, covered_.records);
    for (const auto& [candidates, kept] : requests())
      results.push_back(block_grams(passes(memory, jobs), candidates, kept));
  }
  const std::size_t half = results.size() / 2;
  for (std::size_t r = 0; r < half; ++r) {
    for (std::size_t b = 0; b < results[r].blocks.size(); ++b)
      EXPECT_EQ(results[r].blocks[b].gram, results[half + r].blocks[b].gram);
  }
}

TEST_F(Remembered, InstrumentsAreTheSameBitsWithMemoryAskedOnceOrTwice) {
  const std::vector<Candidate> effects = requests()[1].first;
  const auto anew = instrument(passes(nullptr), effects);
  ASSERT_EQ(anew.size(), effects.size());
  const auto memory = std::make_shared<ColumnMemory>(2, covered_.records);
  for (int time = 0; time < 2; ++time) {
    // The second time the recent columns are used, not the stored results.
    memory->instrumented.clear();
    const auto known = instrument(passes(memory), effects);
    ASSERT_EQ(known.size(), anew.size());
    for (std::size_t e = 0; e < anew.size(); ++e) {
      for (std::size_t c = 0; c < anew[e].size(); ++c) {
        EXPECT_EQ(known[e][c].instrument, anew[e][c].instrument) << effects[e].name;
        EXPECT_EQ(known[e][c].least_squares, anew[e][c].least_squares) << effects[e].name;
        EXPECT_EQ(known[e][c].difference_z, anew[e][c].difference_z) << effects[e].name;
      }
    }
  }
}

TEST_F(Remembered, RefinementsAreTheSameBitsWithMemoryAskedOnceOrTwice) {
  const Grams grams = block_grams(passes(nullptr), {candidate("drag_linear"), candidate("motor_lag")});
  const identification::Members members = {{0, 0}, {1, 1}};
  const auto anew = refine(passes(nullptr), grams, members);
  const auto memory = std::make_shared<ColumnMemory>(2, covered_.records);
  for (int time = 0; time < 2; ++time) {
    const auto known = refine(passes(memory), grams, members);
    ASSERT_EQ(known.size(), anew.size());
    for (std::size_t e = 0; e < anew.size(); ++e) {
      EXPECT_EQ(known[e].coefficients, anew[e].coefficients);
      EXPECT_EQ(known[e].theta, anew[e].theta);
    }
    EXPECT_EQ(memory->refinements.size(), 1u);
  }
}

}  // namespace
}  // namespace swarmcert::tests
