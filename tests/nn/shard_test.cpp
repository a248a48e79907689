#include "nn/base/shard.h"

#include <gtest/gtest.h>

#include <set>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/temp_folder.h"

namespace swarmcert::files {
namespace {

TEST(Shard, PartsCoverEachUnitOnceFromZeroOrFromOne) {
  for (const int count : {1, 3, 7}) {
    for (const int first : {0, 1}) {
      std::multiset<long> units;
      for (int part = first; part < first + count; ++part) {
        const std::optional<Shard> shard = shard_of(std::to_string(part) + "/" + std::to_string(count));
        ASSERT_TRUE(shard);
        for (long unit = 0; unit < 50; ++unit) {
          if (shard->has(unit)) units.insert(unit);
        }
      }
      for (long unit = 0; unit < 50; ++unit) EXPECT_EQ(units.count(unit), 1u) << unit << " of " << count;
    }
  }
}

TEST(Shard, OtherTextsAreNone) {
  for (const char* text :
       {"", "1", "/", "1/", "/2", "3/2", "-1/2", "1/0", "1/2x", "1 /2", "x/2", "1/1000001"})
    EXPECT_FALSE(shard_of(text)) << text;
}

class KeptUnit : public testing::Test {
 protected:
  Json compute_with(const std::string& key) {
    return kept_unit(file_, "swarmcert/unit/1", key, [this] {
      ++computed_;
      Json unit;
      unit["number"] = computed_;
      return unit;
    });
  }

  tests::TempFolder folder_;
  std::string file_ = folder_ / "new/unit.json";
  int computed_ = 0;
};

TEST_F(KeptUnit, IsComputedOnceForEachKey) {
  EXPECT_EQ(compute_with("a").at("number"), 1);
  EXPECT_EQ(compute_with("a").at("number"), 1);
  EXPECT_EQ(compute_with("b").at("number"), 2);
  EXPECT_EQ(compute_with("b").at("number"), 2);
  EXPECT_EQ(computed_, 2);
}

TEST_F(KeptUnit, IsNotWrittenWhereItFails) {
  const auto fail = [&] {
    return kept_unit(file_, "swarmcert/unit/1", "a", []() -> Json { throw std::runtime_error("no"); });
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(compute_with("a").at("number"), 1);
}

TEST_F(KeptUnit, IsNotReplacedWhereTheFileIsSomethingElse) {
  compute_with("a");
  write_file(file_, "{\"schema\": \"swarmcert/gains/1\"}\n", true);
  EXPECT_THROW(compute_with("a"), InputError);
  EXPECT_EQ(computed_, 1);
}

}  // namespace
}  // namespace swarmcert::files
