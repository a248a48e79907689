/// Tests that validation against the schemas detects violations. The validation itself runs in every test that runs the
/// tool (analysis/run.h).
#include "schemas/schema_check.h"

#include <gtest/gtest.h>

namespace swarmcert::tests {
namespace {

constexpr const char* kHead =
    R"({"schema": "swarmcert/check/1", "tool": "swarmcert 1", "command_line": ["swarmcert"], )"
    R"("inputs": [], "seed": null,)";
constexpr const char* kBody =
    R"("accepted": true, "reason": "r", "chain": "c", "spectral_norms": 1, "upper_bounds": 1, )"
    R"("lower_bounds": 1, "values": 0)";

TEST(SchemaCheck, AcceptsAResult) {
  EXPECT_EQ(schema_faults(std::string(kHead) + kBody + "}"), std::vector<std::string>());
}

TEST(SchemaCheck, RefusesAFieldThatTheSchemaDoesNotKnow) {
  EXPECT_FALSE(schema_faults(std::string(kHead) + kBody + R"(, "surprise": 1})").empty());
}

TEST(SchemaCheck, RefusesAnotherTypeAndAMissingField) {
  std::string text = std::string(kHead) + kBody + "}";
  EXPECT_FALSE(schema_faults(text.replace(text.find("true"), 4, "1")).empty());
  EXPECT_FALSE(schema_faults(std::string(kHead) + R"("accepted": true})").empty());
}

TEST(SchemaCheck, RefusesAKindThatHasNoSchema) {
  EXPECT_FALSE(schema_faults(R"({"schema": "swarmcert/unheard-of/1"})").empty());
}

TEST(SchemaCheck, LeavesWhatIsNotOursAlone) {
  EXPECT_TRUE(schema_faults(R"({"version": "2.1.0"})").empty());
  EXPECT_TRUE(schema_faults("{ truncated").empty());
}

}  // namespace
}  // namespace swarmcert::tests
