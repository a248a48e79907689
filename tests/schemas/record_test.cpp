/// A described result: its JSON, its schema and its tables say the same.
#include "nn/base/record.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "analysis/report/table.h"
#include "nn/base/file_keys.h"

namespace swarmcert::tests {

struct Mast {
  std::string name;
  double height_m = 0;
  double load_N = 0;
};

struct Ship {
  double speed_m_s = 0;
  std::optional<double> depth_m;
  std::optional<std::string> keel;
  std::vector<Mast> masts;
  std::map<std::string, int> crew;
};

void describe(files::Record& record, const Ship& ship) {
  record.field("speed_m_s", ship.speed_m_s, "Through the water.", "m/s", "estimate");
  record.field("depth_m", ship.depth_m, "null: not measured.", "m");
  record.may("keel", ship.keel, "Only of ships that have one.");
  record.list("masts", ship.masts, "From bow to stern.", [](files::Record& one, const Mast& mast) {
    one.field("name", mast.name, "Of the mast.");
    one.field("height_m", mast.height_m, "Above the deck.", "m");
    one.field("load_N", mast.load_N, "Of the wind.", "N");
  });
  record.field("crew", ship.crew, "Number by rank.");
  record.constant("unit", "m", "Of lengths.");
}

namespace {

using Json = nlohmann::ordered_json;

Ship two_masts() {
  return {3.5, std::nullopt, std::nullopt, {{"fore", 12, 0.5}, {"main", 17.25, 1}}, {{"mate", 2}}};
}

TEST(Record, JsonHoldsTheFieldsInOrderAndNullWhereThereIsNoNumber) {
  Ship ship = two_masts();
  ship.speed_m_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(files::to_json(files::record_of(ship)).dump(),
            R"({"speed_m_s":null,"depth_m":null,"masts":[{"name":"fore","height_m":12.0,"load_N":0.5},)"
            R"({"name":"main","height_m":17.25,"load_N":1.0}],"crew":{"mate":2},"unit":"m"})");
}

TEST(Record, SchemaListsEveryFieldAndNothingElseWhateverTheValuesAre) {
  const Json schema = files::schema_of(files::shape_of<Ship>(), "ship", "A ship", "For the test.", true);
  EXPECT_EQ(schema["additionalProperties"], false);
  EXPECT_EQ(schema["required"], Json({"speed_m_s", "depth_m", "masts", "crew", "unit"}));
  const Json& fields = schema["properties"];
  EXPECT_EQ(fields["speed_m_s"], Json({{"description", "Through the water."},
                                       {"unit", "m/s"},
                                       {"guarantee", "estimate"},
                                       {"type", {"number", "null"}}}));
  EXPECT_EQ(fields["keel"]["type"], "string");
  EXPECT_EQ(fields["masts"]["items"]["required"], Json({"name", "height_m", "load_N"}));
  EXPECT_EQ(fields["crew"]["additionalProperties"]["type"], "integer");
  EXPECT_EQ(fields["unit"]["const"], "m");
}

TEST(Record, AFieldThatIsDescribedTwiceIsAnErrorOfTheProgram) {
  files::Node node;
  files::Record record(node, false);
  record.field("length", 1, "Of the ship.");
  EXPECT_THROW(record.field("length", 2, "Of the ship."), std::logic_error);
}

TEST(Table, HeadsCarryTheDescribedUnitAndForcesHaveTheUnitOfTheRun) {
  const files::Node node = files::record_of(two_masts());
  const analysis::Table table = analysis::table(
      *node.find("masts"), {{"name", "mast"}, {"height_m", "", "{:.1f}"}, {"load_N", "wind"}}, {"mN", 1e-3});
  EXPECT_EQ(table.header, (std::vector<std::string>{"mast", "height [m]", "wind [mN]"}));
  EXPECT_EQ(table.rows[1], (std::vector<std::string>{"main", "17.2", "1000"}));
  EXPECT_EQ(analysis::to_text(table),
            "  mast  height [m]  wind [mN]\n"
            "  fore        12.0        500\n"
            "  main        17.2       1000\n");
  EXPECT_EQ(analysis::table(*node.find("masts"), {{"name"}, {"rake?"}}).header.size(), 1u)
      << "no mast has it";
  EXPECT_EQ(analysis::cell(*node.find("crew")), "mate 2");
}

TEST(Table, UnitsThatAreNoForcesStay) {
  const analysis::ForceScale gram{"gf", 0.00980665};
  EXPECT_EQ(analysis::shown_unit("N/s", gram).second, "gf/s");
  EXPECT_NEAR(analysis::shown_unit("N s", gram).first, 101.97162, 1e-4);  // gf in a newton: 1 / 0.00980665
  for (const char* unit : {"N m", "m per N/s", "m"}) EXPECT_EQ(analysis::shown_unit(unit, gram).second, unit);
}

/// A file's reader and its schema see the same keys.
TEST(FileKeys, AreKnownToTheReaderAndToTheSchema) {
  const files::KeysOfTable mast = [](files::Keys& keys) {
    keys.must<double>("height_m", "Above deck.", "m");
  };
  const files::KeysOfTable ship = [&mast](files::Keys& keys) {
    keys.schema("swarmcert/ship/1");
    keys.must("rig", "", "", files::OneOf{{"sloop", "ketch"}});
    keys.may<files::NumberOrThree>("speed_m_s", "");
    keys.may_tables("mast", "From bow to stern.", mast);
    keys.must_named_tables("boat", "", mast);
  };
  EXPECT_EQ(files::key_names(ship), (std::vector<std::string>{"schema", "rig", "speed_m_s", "mast", "boat"}));
  const Json schema = files::schema_of(files::shape_of_table(ship), "ship", "", "", false);
  EXPECT_EQ(schema["required"], Json({"schema", "rig", "boat"}));
  EXPECT_EQ(schema["properties"]["schema"]["const"], "swarmcert/ship/1");
  EXPECT_EQ(schema["properties"]["rig"]["enum"], Json({"sloop", "ketch"}));
  EXPECT_EQ(schema["properties"]["speed_m_s"]["anyOf"].size(), 2u);
  const Json& height = schema["properties"]["mast"]["items"]["properties"]["height_m"];
  EXPECT_EQ(height, Json({{"description", "Above deck."}, {"unit", "m"}, {"type", "number"}}));
  EXPECT_EQ(schema["properties"]["boat"]["additionalProperties"]["properties"]["height_m"], height);
}

}  // namespace
}  // namespace swarmcert::tests
