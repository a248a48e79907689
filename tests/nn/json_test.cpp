#include "nn/base/json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>

#include "nn/base/file_io.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using tests::refuses;

TEST(Json, AByteOrderMarkIsRefused) {
  EXPECT_TRUE(refuses([] { parse_json("\xef\xbb\xbf{}", "x.json"); }, {"x.json", "byte order mark"}));
}

TEST(HexFloat, IsC99AndHasAPrefix) {
  EXPECT_EQ(hex_float(3.0), "0x1.8p+1");
  EXPECT_EQ(hex_float(-0.15625), "-0x1.4p-3");
  EXPECT_EQ(hex_float(0.0), "0x0p+0");
  EXPECT_EQ(hex_float(-0.0), "-0x0p+0");
  EXPECT_EQ(hex_float(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(hex_float(-std::numeric_limits<double>::infinity()), "-inf");
  EXPECT_EQ(hex_float(std::numeric_limits<double>::quiet_NaN()), "nan");
}

TEST(HexFloat, RoundTripKeepsEveryBit) {
  std::mt19937_64 generator(1);
  int finite = 0;
  for (int trial = 0; trial < 100'000; ++trial) {
    std::uint64_t bits = generator();
    if (trial % 4 == 0) bits &= 0x800fffffffffffffu;  // subnormal
    double number;
    std::memcpy(&number, &bits, sizeof number);
    if (!std::isfinite(number)) continue;
    ++finite;
    const double again = parse_hex_float(hex_float(number));
    ASSERT_EQ(std::memcmp(&again, &number, sizeof number), 0) << hex_float(number);
    ASSERT_EQ(std::strtod(hex_float(number).c_str(), nullptr), number);
  }
  EXPECT_GT(finite, 90'000);
}

TEST(HexFloat, AcceptsOtherSpellingsOfTheSameNumber) {
  EXPECT_EQ(parse_hex_float("0x3p0"), 3.0);
  EXPECT_EQ(parse_hex_float("0X1.8P+01"), 3.0);
  EXPECT_EQ(parse_hex_float("0x0.0000000000001p-1022"), 0x1p-1074);
  EXPECT_EQ(parse_hex_float("0xA.80000000000000000000000000p-2"), 2.625);
  EXPECT_EQ(parse_hex_float("0x100000000000000000000p-80"), 1.0);
  EXPECT_EQ(parse_hex_float("0x0.p+99999"), 0.0);
  EXPECT_EQ(parse_hex_float("0x1.fffffffffffffp+1023"), std::numeric_limits<double>::max());
}

TEST(HexFloat, RefusesWhatADoubleDoesNotHoldExactly) {
  for (const char* const text :
       {"0x1.00000000000008p+0", "0x1.fffffffffffff8p+1023", "0x1p+1024", "0x1p-1075", "0x1.8p-1074",
        "0x1p+999999999999", "0x10000000000000001p+0", "0x1.00000000000000000000000001p+0"}) {
    EXPECT_THROW(parse_hex_float(text), std::invalid_argument) << text;
  }
}

TEST(HexFloat, RefusesWhatIsNotOneCompleteHexFloat) {
  for (const char* const text :
       {"", "0x", "0xp+0", "0x.p+0", "1.5", "0x1.8", "0x1.8p", "0x1.8p+", "0x1.8p+1 ", " 0x1p+0", "0x1p+0x",
        "+0x1p+0", "--0x1p+0", "0x1.2.3p+0", "0x1p--1", "inf", "nan", "-inf"}) {
    EXPECT_THROW(parse_hex_float(text), std::invalid_argument) << text;
  }
}

TEST(Json, KeepsTheOrderOfKeysAndEndsWithANewline) {
  const std::string text = "{\n  \"z\": 1,\n  \"a\": [\n    2\n  ]\n}\n";
  EXPECT_EQ(to_text(parse_json(text, "x.json")), text);
}

TEST(Json, ErrorsHaveLineAndColumn) {
  EXPECT_TRUE(refuses([] { parse_json("{\n  \"a\": 1,\n  \"b\": ?\n}", "x.json"); },
                      {"x.json: line 3, column 9: is not JSON"}));
  EXPECT_TRUE(refuses([] { parse_json("", "x.json"); }, {"x.json: line 1, column 1"}));
  EXPECT_TRUE(refuses([] { parse_json("{} {}", "x.json"); }, {"x.json: line 1, column", "not JSON"}));
  EXPECT_TRUE(refuses([] { parse_json("[1e999]", "x.json"); }, {"x.json: line 1"}));
  EXPECT_TRUE(refuses([] { parse_json("\"\xff\"", "x.json"); }, {"x.json: line 1"}));
}

TEST(Json, AKeyThatAppearsTwiceIsRefused) {
  EXPECT_TRUE(refuses([] { parse_json("{\"a\": {\"b\": 1,\n\"b\": 2}}", "x.json"); },
                      {"x.json: line 2, column 4: \"b\": appears twice"}));
  EXPECT_NO_THROW(parse_json("{\"a\": {\"a\": {}}, \"b\": [{\"a\": 1}, {\"a\": 1}]}", "x.json"));
}

TEST(Json, DepthAndKeysAreLimited) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_NO_THROW(parse_json(nested(64), "x.json"));
  EXPECT_TRUE(refuses([&] { parse_json(nested(65), "x.json"); }, {"64 levels"}));
  EXPECT_TRUE(refuses([&] { parse_json(std::string(5'000'000, '['), "x.json"); }, {"64 levels"}));
  std::string many = "{\"x\":0";
  for (int i = 0; i < 10'000; ++i) many += ",\"" + std::to_string(i) + "\":0";
  EXPECT_TRUE(refuses([&] { parse_json(many + "}", "x.json"); }, {"too many keys"}));
}

TEST(Json, TheSchemaMustFit) {
  const tests::TempFolder folder;
  const std::string path = folder / "schema.json";
  write_file(path, "{\"schema\": \"swarmcert/certificate/1\", \"x\": 2}", true);
  EXPECT_EQ(read_json(path, "swarmcert/certificate/1")["x"], 2);
  EXPECT_TRUE(refuses([&] { read_json(path, "swarmcert/certificate/2"); },
                      {path, "schema = \"swarmcert/certificate/1\"", "must be \"swarmcert/certificate/2\""}));
  EXPECT_TRUE(refuses([] { parse_json("[1]", "x.json", "s"); }, {"not a JSON object"}));
  EXPECT_TRUE(refuses([] { parse_json("{\"schema\": 1}", "x.json", "s"); }, {"schema", "must be \"s\""}));
}

TEST(Json, BytesThatAreNotUtf8DoNotStopAReport) {
  Json document;
  document["path"] = "\xff.pth";
  EXPECT_NO_THROW(to_text(document));
}

}  // namespace
}  // namespace swarmcert::files
