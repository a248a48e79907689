/// Our strict TOML reader: the right value, or an error with line, dotted key, value and what is expected.
#include "nn/base/toml.h"

#include <gtest/gtest.h>

#include "refusal.h"

namespace swarmcert::files {
namespace {

using tests::refuses;

constexpr char kText[] = R"(name = "s"
matrix = [[1, 2.5], [3]]
empty = []
on = true
limit = inf
rows_with_text = [[1, "2"]]
rows_with_inf = [[1, inf]]
[inner]
kind = "b"
[[part]]
size = 1
[[part]]
size = "2"
)";

class Toml : public testing::Test {
 protected:
  toml::table document_ = parse_toml(kText, "f.toml");
  TomlTable table_{document_, "f.toml"};
};

TEST_F(Toml, ValuesOfEveryTypeAreRead) {
  EXPECT_EQ(table_.rows("matrix"), (std::vector<std::vector<double>>{{1, 2.5}, {3}}));
  EXPECT_TRUE(table_.flag("on"));
  EXPECT_EQ(table_.table("inner").text("kind"), "b");
  EXPECT_EQ(table_.tables("part").size(), 2u);
  EXPECT_EQ(table_.tables("part")[0].number("size"), 1);
  EXPECT_EQ(table_.table("inner").choice("kind", {"a", "b"}), 1u);
}

TEST_F(Toml, ListsAreToldApart) {
  EXPECT_TRUE(table_.is_list("matrix") && table_.is_list_of_lists("matrix"));
  EXPECT_TRUE(table_.is_list("empty") && !table_.is_list_of_lists("empty"));
  EXPECT_FALSE(table_.is_list("name") || table_.is_list("none") || table_.is_list_of_lists("none"));
}

TEST_F(Toml, ValuesOfAnotherTypeAreRefusedWithLineKeyAndValue) {
  EXPECT_TRUE(
      refuses([&] { table_.rows("name"); }, {"f.toml: line 1: name = \"s\"", "list of lists of numbers"}));
  EXPECT_TRUE(refuses([&] { table_.rows("part"); }, {"part = a table", "list of lists"}));
  EXPECT_TRUE(refuses([&] { table_.rows("rows_with_text"); }, {"line 6", "= \"2\"", "list of lists"}));
  EXPECT_TRUE(refuses([&] { table_.rows("rows_with_inf"); }, {"line 7", "= inf", "must be finite"}));
  EXPECT_TRUE(refuses([&] { table_.number("limit"); }, {"line 5: limit = inf", "must be finite"}));
  EXPECT_TRUE(refuses([&] { table_.table("on"); }, {"line 4: on = true", "must be a table"}));
  EXPECT_TRUE(refuses([&] { table_.tables("inner"); }, {"inner = a table", "write [[inner]]"}));
  EXPECT_TRUE(refuses([&] { table_.tables("matrix"); }, {"matrix = a list", "write [[matrix]]"}));
  EXPECT_TRUE(refuses([&] { table_.flag("name"); }, {"name = \"s\"", "must be true or false"}));
  EXPECT_TRUE(refuses([&] { table_.number("none"); }, {"f.toml", "none", "is missing"}));
}

TEST_F(Toml, KeysInTablesAreNamedWithTheirPath) {
  EXPECT_TRUE(refuses([&] { table_.table("inner").number("kind"); }, {"line 9: inner.kind = \"b\""}));
  EXPECT_TRUE(refuses([&] { table_.tables("part")[1].number("size"); }, {"line 13: part[2].size = \"2\""}));
  EXPECT_TRUE(refuses([&] { table_.table("inner").allow_only({"kinds"}); },
                      {"inner.kind", "did you mean \"kinds\"?"}));
}

}  // namespace
}  // namespace swarmcert::files
