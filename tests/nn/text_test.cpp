// Small operations on text and numbers that several folders share.
#include "nn/base/text.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "nn/base/median.h"

namespace swarmcert::files {
namespace {

TEST(EndsWith, ComparesTheLastCharactersOnly) {
  EXPECT_TRUE(ends_with("network.toml", ".toml"));
  EXPECT_TRUE(ends_with(".toml", ".toml"));
  EXPECT_TRUE(ends_with("x", ""));
  EXPECT_FALSE(ends_with("toml", ".toml"));
  EXPECT_FALSE(ends_with("network.toml.bak", ".toml"));
}

TEST(SplitAtCommas, KeepsEmptyPartsInFrontOfAComma) {
  using Parts = std::vector<std::string>;
  EXPECT_EQ(split_at_commas("fc1,fc2,fc3"), (Parts{"fc1", "fc2", "fc3"}));
  EXPECT_EQ(split_at_commas("a,,b"), (Parts{"a", "", "b"}));
  EXPECT_EQ(split_at_commas(",a"), (Parts{"", "a"}));
  EXPECT_EQ(split_at_commas("a,"), (Parts{"a"})) << "a comma ends a part";
  EXPECT_EQ(split_at_commas(""), Parts());
}

TEST(UpperMedian, IsTheLargerOfTwoMiddleValues) {
  EXPECT_EQ(upper_median({5, 1, 3}), 3);
  EXPECT_EQ(upper_median({4, 1, 3, 2}), 3);
  EXPECT_EQ(upper_median({7}), 7);
  EXPECT_EQ(upper_median({}), 0);
}

}  // namespace
}  // namespace swarmcert::files
