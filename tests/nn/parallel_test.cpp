#include "nn/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace swarmcert::files {
namespace {

TEST(ParallelFor, EveryPieceRunsOnce) {
  for (const int jobs : {0, 1, 3, 100}) {
    std::vector<std::atomic<int>> calls(50);
    parallel_for(50, jobs, [&](int i) { ++calls[static_cast<std::size_t>(i)]; });
    for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1) << jobs << " jobs";
  }
}

TEST(ParallelFor, NoPiecesIsNothingToDo) {
  parallel_for(0, 2, [](int) { FAIL(); });
  parallel_for(-1, 2, [](int) { FAIL(); });
}

TEST(ParallelFor, TheErrorOfTheFirstPieceThatFailedIsThrownAndLaterPiecesAreLeftOut) {
  std::atomic<int> begun{0};
  try {
    parallel_for(1000, 1, [&](int i) {
      ++begun;
      if (i == 3) throw std::runtime_error("piece " + std::to_string(i));
    });
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "piece 3");
  }
  EXPECT_EQ(begun, 4);
  EXPECT_THROW(parallel_for(8, 4, [](int) { throw std::runtime_error("all fail"); }), std::runtime_error);
}

}  // namespace
}  // namespace swarmcert::files
