#include "nn/weights/network.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

#include "data.h"
#include "nn/base/file_io.h"
#include "nn/weights/compositions.h"
#include "random_network.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using tests::refuses;

constexpr char kFull[] = R"(schema = "swarmcert/network/1"
output = { quantity = "force_z", unit = "gf" }
gamma = { value = 3.0, scope = "layer", mode = "clip" }
[input]
order = ["dp_x_m", "dp_y_m", "dp_z_m", "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"]
clamp = { lower = [-1, -1, -1, -2, -2, -2], upper = [1, 1, 1, 2, 2, 2] }
[phi.small]
weights = "6x20"
[phi.ground]
weights = "4x20"
[rho.small]
weights = "20x1"
[rho.large]
weights = "20x1"
)";

/// Returns a network of the size stated in its file name.
Weights sized(const std::string& path, const LayerChoice& choice = {}) {
  std::mt19937 generator(1);
  const std::string name = std::filesystem::path(path).filename().string();
  const std::size_t cross = name.find('x');
  Weights weights = tests::random_network({std::stoi(name), std::stoi(name.substr(cross + 1))}, generator);
  weights.path = path;
  if (!choice.order.empty()) weights.layers.front().name = choice.order.front();
  return weights;
}
Network parse(const std::string& text) { return parse_network(text, "nets/network.toml", sized); }
testing::AssertionResult network_is_refused(const std::string& text, const std::vector<std::string>& pieces) {
  return refuses([&] { parse(text); }, pieces);
}

/// Returns kFull with `from` replaced by `to`.
std::string with(const std::string& from, const std::string& to) {
  std::string text = kFull;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(NetworkToml, SilentCompositionsAreOfKindsThatItHasInAnyOrderAndEachOnce) {
  const auto silent = [](const std::string& list) {
    return with("[input]", "[phi.large]\nweights = \"6x20\"\n[input]")
        .insert(std::string("schema = \"swarmcert/network/1\"\n").size(), "silent = " + list + "\n");
  };
  const Network network = parse(silent("[\"small+large+small>large\", \">small\", \"large>small\"]"));
  const std::vector<std::string> three = {"large", "small", "small"};
  EXPECT_EQ(network.silent.at("large"), (std::set<std::vector<std::string>>{three}));
  EXPECT_EQ(network.silent.at("small"), (std::set<std::vector<std::string>>{{}, {"large"}}));
  EXPECT_EQ(neighbour_kinds(network), (std::vector<std::string>{"large", "small"}));
  EXPECT_EQ(silent_counts(network, "large"), (std::vector<int>{1, 2}));
  EXPECT_EQ(silent_counts(network, "small"), (std::vector<int>{0, 0, 1, 0}));
  EXPECT_EQ(composition_name({"small", "large"}, "small"), "large+small>small");
  EXPECT_TRUE(is_ever_silent(network, "set:large:small"));
  EXPECT_FALSE(is_ever_silent(network, "rho:small"));
  EXPECT_TRUE(parse(kFull).silent.empty());
  const auto refused = [&](const std::string& list, const std::vector<std::string>& pieces) {
    return network_is_refused(silent(list), pieces);
  };
  EXPECT_TRUE(refused("[]", {"line 2: silent", "names no composition"}));
  EXPECT_TRUE(refused("[\"small\"]", {"line 2: silent", "\"small\"", "is not a composition"}));
  EXPECT_TRUE(refused("[\"small>tiny\"]", {"there is no rho.tiny"}));
  EXPECT_TRUE(refused("[\"tiny>small\"]", {"there is no phi.tiny"}));
  EXPECT_TRUE(refused("[\"ground>small\"]", {"there is no phi.ground of a neighbour"}));
  EXPECT_TRUE(refused("[\"small+>small\"]", {"there is no phi. of a neighbour"}));
  EXPECT_TRUE(refused("[\"small+large>small\", \"large+small>small\"]", {"named twice"}));
}

TEST(NetworkToml, SilentCompositionsAreFoundByTheNeighboursAndFromOneNeighbourMoreOrLess) {
  Network network;
  network.silent["small"] = {{}, {"small"}, {"large", "small"}};
  EXPECT_TRUE(is_silent_among(network, "set:small:small", {"phi:small", "phi:ground", "phi:large"}));
  EXPECT_TRUE(is_silent_among(network, "set:ground:small", {"phi:ground"}));
  EXPECT_FALSE(is_silent_among(network, "set:small:small", {"phi:small", "phi:small"}));
  EXPECT_FALSE(is_silent_among(network, "set:small:large", {"phi:small"}));
  EXPECT_FALSE(is_silent_among(network, "phi:small", {"phi:small"}));
  EXPECT_EQ(silent_up_to(network, "set:small:small", 0), 1);
  EXPECT_EQ(silent_up_to(network, "set:small:small", 5), 2);
  EXPECT_EQ(silent_up_to(network, "set:large:small", 5), 1);
  EXPECT_EQ(silent_up_to(network, "set:small:large", 5), 0);
  using Beside = std::set<std::vector<FunctionId>>;
  EXPECT_EQ(beside_silent(network, "set:small:small"),
            (Beside{{"phi:small", "phi:small"}, {"phi:large"}, {"phi:large", "phi:small", "phi:small"}}));
  EXPECT_EQ(beside_silent(network, "set:large:small"),
            (Beside{{"phi:large"}, {"phi:large", "phi:large", "phi:small"}}));
  EXPECT_TRUE(beside_silent(network, "set:ground:small").empty());
  EXPECT_TRUE(beside_silent(network, "set:small:large").empty());
}

TEST(NetworkToml, EveryKeyIsRead) {
  const Network network = parse(kFull);
  EXPECT_EQ(network.path, "nets/network.toml");
  EXPECT_EQ(network.sha256, sha256(kFull));
  EXPECT_FALSE(network.plain);
  ASSERT_EQ(network.phi.size(), 2u);
  EXPECT_EQ(network.phi.at("small").path, "nets/6x20");
  EXPECT_EQ(network.phi.at("ground").inputs(), kGroundInputs);
  EXPECT_EQ(network.rho.size(), 2u);
  EXPECT_EQ(network.output_quantity, "force_z");
  EXPECT_EQ(network.output_unit, "gf");
  EXPECT_EQ(network.input_order.size(), 6u);
  EXPECT_EQ(network.input_order[3], "dv_x_m_s");
  EXPECT_EQ(network.clamp->lower, (std::vector<double>{-1, -1, -1, -2, -2, -2}));
  EXPECT_EQ(network.clamp->upper, (std::vector<double>{1, 1, 1, 2, 2, 2}));
  EXPECT_EQ(network.gamma->value, 3.0);
  EXPECT_EQ(network.gamma->scope, GammaStatement::Scope::kLayer);
  EXPECT_EQ(network.gamma->mode, GammaStatement::Mode::kClip);
}

TEST(NetworkToml, TheOrderOfAPartsLayersReachesItsReader) {
  const std::string text =
      "schema = \"swarmcert/network/1\"\n[phi.a]\nweights = \"3x5\"\norder = [\"first\"]\n"
      "[rho.b]\nweights = \"5x2\"\n";
  const Network network = parse(text);
  EXPECT_EQ(network.phi.at("a").layers.front().name, "first");
  EXPECT_EQ(network.rho.at("b").layers.front().name, "fc1");
  EXPECT_TRUE(
      network_is_refused("schema = \"swarmcert/network/1\"\n[phi.a]\nweights = \"3x5\"\norder = []\n"
                         "[rho.b]\nweights = \"5x2\"\n",
                         {"line 4", "phi.a.order", "names no layer"}));
}

TEST(NetworkToml, OnlySchemaPhiAndRhoAreNeeded) {
  const Network network =
      parse("schema = \"swarmcert/network/1\"\nphi.a.weights = \"3x5\"\nrho.b.weights = \"5x2\"\n");
  EXPECT_EQ(network.output_quantity, "");
  EXPECT_EQ(network.output_unit, "");
  EXPECT_TRUE(network.input_order.empty());
  EXPECT_FALSE(network.clamp);
  EXPECT_FALSE(network.gamma);
}

TEST(NetworkToml, OtherStatementsAreRead) {
  const Network network = parse(with("value = 3.0, scope = \"layer\", mode = \"clip\"",
                                     "value = 2, scope = \"network\", mode = \"equal\""));
  EXPECT_EQ(network.gamma->value, 2.0);
  EXPECT_EQ(network.gamma->scope, GammaStatement::Scope::kNetwork);
  EXPECT_EQ(network.gamma->mode, GammaStatement::Mode::kEqual);
  EXPECT_EQ(parse(with("\"gf\"", "\"N\"")).output_unit, "N");
}

TEST(NetworkToml, UnknownKeysAreRefusedWithLineAndSuggestion) {
  EXPECT_TRUE(
      network_is_refused(with("gamma = {", "gama = {"), {"nets/network.toml: line 3: gama", "\"gamma\"?"}));
  EXPECT_TRUE(
      network_is_refused(with("unit =", "units ="), {"line 2: output.units", "did you mean \"unit\"?"}));
  EXPECT_TRUE(
      network_is_refused(with("scope =", "zzz ="), {"line 3: gamma.zzz", "allowed: value, scope, mode"}));
  EXPECT_TRUE(network_is_refused(with("order =", "ordr ="), {"line 5: input.ordr", "\"order\"?"}));
  EXPECT_TRUE(network_is_refused(with("lower =", "low ="), {"line 6: input.clamp.low"}));
  EXPECT_TRUE(network_is_refused(with("weights = \"4x20\"", "wieghts = \"4x20\""),
                                 {"line 10: phi.ground.wieghts", "\"weights\"?"}));
}

TEST(NetworkToml, AKindWithAColonIsRefusedForItSeparatesKindsInNamesOfFunctions) {
  for (const std::string kind : {"x:y", ":", "small:"})
    EXPECT_TRUE(network_is_refused("schema = \"swarmcert/network/1\"\n[phi.\"" + kind +
                                       "\"]\nweights = \"6x5\"\n[rho.small]\nweights = \"5x1\"\n",
                                   {kind, "must not contain ':'"}));
}

TEST(NetworkToml, MissingKeysAreRefused) {
  EXPECT_TRUE(network_is_refused(with("schema = \"swarmcert/network/1\"", ""), {"schema: is missing"}));
  EXPECT_TRUE(network_is_refused(with("network/1", "network/2"),
                                 {"line 1: schema", "must be \"swarmcert/network/1\""}));
  EXPECT_TRUE(network_is_refused(with(", unit = \"gf\"", ""), {"line 2: output.unit: is missing"}));
  EXPECT_TRUE(network_is_refused(with("value = 3.0, ", ""), {"line 3: gamma.value: is missing"}));
  EXPECT_TRUE(network_is_refused(with("lower = [-1, -1, -1, -2, -2, -2], ", ""),
                                 {"line 6: input.clamp.lower: is missing"}));
  EXPECT_TRUE(network_is_refused(with("weights = \"6x20\"", ""), {"line 7: phi.small.weights: is missing"}));
  EXPECT_TRUE(
      network_is_refused("schema = \"swarmcert/network/1\"\nphi.a.weights = \"3x5\"\n", {"rho: is missing"}));
  EXPECT_TRUE(network_is_refused("schema = \"swarmcert/network/1\"\n[phi]\n[rho]\n",
                                 {"line 2: phi", "no kind of vehicle"}));
}

/// Returns kFull with another output quantity and `numbers` outputs from every rho.
std::string of_quantity(const std::string& output, int numbers) {
  std::string text = with("{ quantity = \"force_z\", unit = \"gf\" }", output);
  for (std::size_t at = 0; (at = text.find("20x1", at)) != std::string::npos; ++at)
    text.replace(at, 4, "20x" + std::to_string(numbers));
  return text;
}

TEST(NetworkToml, AQuantityHasItsUnitsAndItsNumberOfOutputs) {
  EXPECT_EQ(parse(of_quantity("{ quantity = \"force\", unit = \"gf\" }", 3)).output_quantity, "force");
  EXPECT_EQ(parse(of_quantity("{ quantity = \"torque\", unit = \"mN_m\" }", 3)).output_unit, "mN_m");
  EXPECT_TRUE(network_is_refused(of_quantity("{ quantity = \"torque\", unit = \"gf\" }", 3),
                                 {"output.unit = \"gf\"", "allowed: mN_m, N_m"}));
  EXPECT_TRUE(network_is_refused(of_quantity("{ quantity = \"force\", unit = \"N\" }", 1),
                                 {"1 outputs", "must be 3: output.quantity is force"}));
  EXPECT_TRUE(network_is_refused(of_quantity("{ quantity = \"force_z\", unit = \"N\" }", 3),
                                 {"3 outputs", "must be 1: output.quantity is force_z"}));
}

TEST(NetworkToml, ValuesOfAnotherTypeAreRefused) {
  EXPECT_TRUE(network_is_refused(with("value = 3.0", "value = \"3\""),
                                 {"line 3: gamma.value = \"3\": must be a number"}));
  EXPECT_TRUE(network_is_refused(with("value = 3.0", "value = inf"), {"gamma.value = inf: must be finite"}));
  EXPECT_TRUE(network_is_refused(with("value = 3.0", "value = nan"), {"gamma.value = nan: must be finite"}));
  EXPECT_TRUE(network_is_refused(with("value = 3.0", "value = -3"), {"gamma.value", "positive"}));
  EXPECT_TRUE(network_is_refused(with("value = 3.0", "value = 2020-01-01"),
                                 {"gamma.value = 2020-01-01: must be a number"}));
  EXPECT_TRUE(network_is_refused(with("\"layer\"", "\"layers\""),
                                 {"line 3: gamma.scope = \"layers\"", "\"layer\"?"}));
  EXPECT_TRUE(network_is_refused(with("\"clip\"", "true"), {"gamma.mode = true: must be text"}));
  EXPECT_TRUE(network_is_refused(with("\"gf\"", "\"kg\""), {"output.unit = \"kg\"", "allowed: gf, N"}));
  EXPECT_TRUE(network_is_refused(with("\"force_z\"", "\"lift\""),
                                 {"output.quantity = \"lift\"", "allowed: force_z, force, torque"}));
  EXPECT_TRUE(network_is_refused(with("{ quantity = \"force_z\", unit = \"gf\" }", "[]"),
                                 {"output = a list: must be a table"}));
  EXPECT_TRUE(
      network_is_refused(with("\"dp_x_m\",", "7,"), {"line 5: input.order = 7: must be a list of texts"}));
  EXPECT_TRUE(network_is_refused(with("[-1, -1, -1, -2", "[\"-1\", -1, -1, -2"),
                                 {"input.clamp.lower", "list of numbers"}));
  EXPECT_TRUE(network_is_refused(with("[-1, -1, -1, -2", "[-inf, -1, -1, -2"),
                                 {"input.clamp.lower = -inf: must be finite"}));
  EXPECT_TRUE(
      network_is_refused(with("lower = [-1, -1, -1, -2, -2, -2]", "lower = -1"), {"input.clamp.lower = -1"}));
  EXPECT_TRUE(network_is_refused(with("weights = \"6x20\"", "weights = {}"),
                                 {"phi.small.weights = a table: must be text"}));
  EXPECT_TRUE(network_is_refused(with("weights = \"6x20\"", "weights = \"\""),
                                 {"phi.small.weights", "not the name of a file"}));
  EXPECT_TRUE(
      network_is_refused(with("6x20", "6x20\\u0000"), {"phi.small.weights", "not the name of a file"}));
}

TEST(NetworkToml, InputsMustFitTogether) {
  EXPECT_TRUE(network_is_refused(with(", \"dv_z_m_s\"", ""),
                                 {"line 6: input.clamp.lower = 6 numbers", "there are 5 inputs"}));
  EXPECT_TRUE(network_is_refused(with("2, 2, 2]", "2, 2]"),
                                 {"line 6: input.clamp.upper = 5 numbers", "there are 6 inputs"}));
  EXPECT_TRUE(network_is_refused(with("\"dp_y_m\"", "\"dp_x_m\""),
                                 {"line 5: input.order = \"dp_x_m\": appears twice"}));
  EXPECT_TRUE(
      network_is_refused(with("upper = [1, 1,", "upper = [1, -3,"), {"line 6", "entry 1 is above upper"}));
  EXPECT_NO_THROW(parse(with("upper = [1, 1,", "upper = [1, -1,")));
}

TEST(NetworkToml, NetworksMustFitTogether) {
  EXPECT_TRUE(network_is_refused(with("6x20", "5x20"),
                                 {"line 8: phi.small.weights = 5 inputs", "must be 6", "input.order"}));
  EXPECT_TRUE(network_is_refused(with("4x20", "6x20"),
                                 {"line 10: phi.ground.weights = 6 inputs", "must be 4", "own"}));
  EXPECT_TRUE(network_is_refused(with("6x20", "6x19"),
                                 {"line 8: phi.small.weights = 19 outputs", "must be 20", "phi.ground"}));
  EXPECT_TRUE(
      network_is_refused(with("20x1", "19x1"), {"line 12: rho.small.weights = 19 inputs", "must be 20"}));
  EXPECT_TRUE(
      network_is_refused(with("20x1", "20x3"), {"line 12: rho.small.weights = 3 outputs", "must be 1"}));
  const std::string without_order =
      "schema = \"swarmcert/network/1\"\nphi.a.weights = \"3x5\"\nphi.b.weights = \"4x5\"\nrho.b.weights = "
      "\"5x2\"\n";
  EXPECT_TRUE(network_is_refused(without_order,
                                 {"line 3: phi.b.weights = 4 inputs", "must be 3", "phi.a has that many"}));
  EXPECT_TRUE(network_is_refused(without_order + "[input]\nclamp = { lower = [0, 0], upper = [1, 1] }\n",
                                 {"phi.a.weights = 3 inputs", "must be 2", "input.clamp"}));
}

TEST(NetworkToml, TextThatIsNotTomlIsRefusedWithLineAndColumn) {
  EXPECT_TRUE(network_is_refused("schema = \n", {"nets/network.toml: line 1, column", "is not TOML"}));
  EXPECT_TRUE(network_is_refused("a = 1\na = 2\n", {"line 2", "is not TOML"}));
  EXPECT_TRUE(network_is_refused(std::string(70'000, '\n'), {"larger than 64 KiB"}));
}

TEST(NetworkToml, TextThatTomlPlusPlusReadsInUndefinedWaysIsRefusedBefore) {
  // Found by fuzzing toml++ 3.3 under the sanitizers: non-ASCII characters outside of what it treats as a string.
  EXPECT_TRUE(
      network_is_refused("\xc5\xb0", {"nets/network.toml: line 1, column 1", "in double quotes only"}));
  EXPECT_TRUE(network_is_refused("a = 1\n\xc3\xa4 = 2\n", {"line 2, column 1", "in double quotes only"}));
  EXPECT_TRUE(network_is_refused("a = '\xc3\xa4'\n", {"line 1, column 6", "in double quotes only"}));
  EXPECT_TRUE(network_is_refused("a = 77f\"-\xef\xbb\xbf\"\n", {"line 1", "is not TOML"}));
  EXPECT_TRUE(network_is_refused("c=7[\"\xef\xbb\x9f", {"line 1", "is not TOML"}));
}

TEST(NetworkToml, TextThatIsNotUtf8IsRefused) {
  for (const char* const bad : {"\x80", "\xc1\x80", "\xc3", "\xc3\"", "\xe0\x80\x80", "\xed\xa0\x80",
                                "\xf0\x80\x80\x80", "\xf4\x90\x80\x80", "\xf8\x80\x80\x80", "\xff"}) {
    EXPECT_TRUE(
        network_is_refused("a = \"" + std::string(bad) + "\"\n", {"line 1, column 6", "is not UTF-8"}));
  }
}

TEST(NetworkToml, WhatUsersWriteIsRead) {
  std::string text =
      "\xef\xbb\xbf# Gr\xc3\xb6\xc3\x9f"
      "e\r\n" +
      std::string(kFull);  // byte order mark, comment, CR LF
  EXPECT_EQ(parse(text).phi.size(), 2u);
  text = with("\"6x20\"", "'6x20'  # \"quotes' in a comment");
  EXPECT_EQ(parse(text).phi.size(), 2u);
  text = with("[-1, -1, -1, -2, -2, -2]", "[\n-1.0, # first\n  -1e0, -1, -2,\n-2, -2,]");
  EXPECT_EQ(parse(text).clamp->lower.size(), 6u);
  for (const char* const letter :
       {"\xc3\xbc", "\xdf\xbf", "\xe2\x82\xac", "\xf0\x9f\x9a\x81", "\\\"\xc3\xbc"}) {
    const std::string text_with =
        with("[phi.ground]", "[phi.\"" + std::string(letter) + "\"]\nweights = \"6x20\"\n[phi.ground]");
    const std::string kind = letter[0] == '\\' ? letter + 1 : letter;
    EXPECT_EQ(parse(text_with).phi.count(kind), 1u) << kind;
  }
  EXPECT_EQ(parse(with("6x20", "\xc3\xbc/6x20")).phi.at("small").path, "nets/\xc3\xbc/6x20");
  EXPECT_EQ(parse(with("[phi.small]", "[ phi . \"sm\\u00e4ll\\\"\" ]")).phi.count("sm\xc3\xa4ll\""), 1u);
  const std::string list = "[input]\norder = [\n\"a\", # one\n  \"b\",\n]\n";
  const std::string networks = "[phi.x]\nweights = \"2x5\"\n[rho.x]\nweights = \"5x1\"\n";
  EXPECT_EQ(parse("schema = \"swarmcert/network/1\"\n" + list + networks).input_order.size(), 2u);
}

TEST(NetworkToml, DeepNestingIsRefused) {
  for (const int depth : {3'990, 4'010, 30'000}) {  // toml++ would overflow the stack on the last
    std::string keys = "a";
    for (int i = 0; i < depth; ++i) keys += ".a";
    EXPECT_TRUE(network_is_refused(keys + " = 1\n", {"nets/network.toml"}));
    EXPECT_TRUE(network_is_refused("[" + keys + "]\n", {"nets/network.toml"}));
  }
  EXPECT_TRUE(network_is_refused("a = " + std::string(60'000, '[') + "\n", {"is not TOML"}));
  std::string tables = "a = ";
  for (int i = 0; i < 10'000; ++i) tables += "{a=";
  EXPECT_TRUE(network_is_refused(tables, {"is not TOML"}));
}

/// Fixture with weight files and a network.toml on disk.
class LoadNetwork : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_ + "/weights");
    for (const char* const size : {"6x20", "4x20", "20x1", "19x1"}) {
      save_safetensors(sized(size), folder_ + "/weights/" + size, true);
    }
    write_file(folder_ + "/network.toml",
               "schema = \"swarmcert/network/1\"\n[phi.small]\nweights = \"weights/6x20\"\n"
               "[rho.small]\nweights = \"weights/20x1\"\n",
               true);
  }
  tests::TempFolder temporary_;
  const std::string folder_ = temporary_.path();
};

TEST_F(LoadNetwork, WeightsAreRelativeToTheToml) {
  const Network network = load_network({{}, folder_ + "/network.toml", "", ""});
  EXPECT_EQ(network.phi.at("small").path, folder_ + "/weights/6x20");
  EXPECT_EQ(network.sha256, sha256(read_file(folder_ + "/network.toml")));
}

TEST_F(LoadNetwork, ATomlUnderAnotherNameIsRecognised) {
  write_file(folder_ + "/renamed", read_file(folder_ + "/network.toml"), true);
  EXPECT_EQ(load_network({{}, folder_ + "/renamed", "", ""}).phi.size(), 1u);
}

TEST_F(LoadNetwork, OneWeightFileIsAPlainNetwork) {
  const Network network = load_network({{}, folder_ + "/weights/6x20", "", ""});
  ASSERT_TRUE(network.plain);
  EXPECT_EQ(network.plain->outputs(), 20);
  EXPECT_TRUE(network.phi.empty() && network.rho.empty() && network.path.empty());
}

TEST_F(LoadNetwork, PhiAndRhoHaveTheDefaultKind) {
  const Network network = load_network({{}, "", folder_ + "/weights/6x20", folder_ + "/weights/20x1"});
  EXPECT_EQ(network.phi.at("default").inputs(), 6);
  EXPECT_EQ(network.rho.at("default").outputs(), 1);
  EXPECT_TRUE(refuses(
      [&] {
        load_network({{}, "", folder_ + "/weights/6x20", folder_ + "/weights/19x1"});
      },
      {"19x1: fc1.weight = 19 inputs", "must be 20"}));
}

TEST_F(LoadNetwork, ErrorsInAWeightFileNameThatFile) {
  write_file(folder_ + "/broken.toml",
             "schema = \"swarmcert/network/1\"\nphi.a.weights = \"nowhere\"\nrho.a.weights = \"nowhere\"\n",
             true);
  EXPECT_TRUE(refuses(
      [&] {
        load_network({{}, folder_ + "/broken.toml", "", ""});
      },
      {folder_ + "/nowhere: cannot be opened"}));
}

TEST_F(LoadNetwork, AmbiguousArgumentsAreAProgrammingError) {
  EXPECT_THROW(load_network({{}, "", "", ""}), std::invalid_argument);
  EXPECT_THROW(load_network({{}, "", "a", ""}), std::invalid_argument);
  EXPECT_THROW(load_network({{}, "a", "b", ""}), std::invalid_argument);
}

TEST_F(LoadNetwork, ThePublishedNetworksFitTogether) {
  SWARMCERT_NEEDS_DATA();
  const auto path = [](const char* name) {
    return "'" +
           std::filesystem::absolute(tests::data_path(std::string("weights/zip_f32/") + name)).string() + "'";
  };
  write_file(folder_ + "/published.toml",
             "schema = \"swarmcert/network/1\"\noutput = { quantity = \"force_z\", unit = \"gf\" }\n"
             "phi.small.weights = " +
                 path("phi_S.pth") + "\nphi.large.weights = " + path("phi_L.pth") +
                 "\nphi.ground.weights = " + path("phi_G.pth") + "\nrho.small.weights = " +
                 path("rho_S.pth") + "\nrho.large.weights = " + path("rho_L.pth") + "\n",
             true);
  const Network network = load_network({{}, folder_ + "/published.toml", "", ""});
  EXPECT_EQ(network.phi.size(), 3u);
  EXPECT_EQ(network.rho.at("large").inputs(), 20);
}

}  // namespace
}  // namespace swarmcert::files
