// Any change in an export, or in the program built from it, is detected.
#include "firmware/exported_network.h"

namespace swarmcert {
namespace {

namespace fs = std::filesystem;
using tests::Outcome;
using tests::read_text;
using tests::write_text;

class Match : public tests::FirmwareTest {
 protected:
  static constexpr const char* kSource = "out/swarmcert_network.cpp";
  static constexpr const char* kHeader = "out/swarmcert_network.h";

  void replace(const std::string& file, const std::string& from, const std::string& to) {
    std::string text = read_text(folder_ / file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << file << " has no " << from;
    write_text(folder_ / file, text.replace(at, from.size(), to));
  }

  /// Returns the result of `match network.toml FILE`, whose exit code must be 1.
  files::Json difference(const std::string& file) {
    const Outcome outcome = run("swarmcert match network.toml " + file + " -q --force --json match.json");
    EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
    const files::Json json = files::parse_json(read_text(folder_ / "match.json"), "match.json");
    EXPECT_EQ(json["equal"], false) << json;
    EXPECT_EQ(json["verdict"], "different");
    return json["first_difference"];
  }

  /// Expects that the change of `file` is found through the folder, the file, and the source next to it.
  void expect_found(const std::string& file, std::size_t line) {
    for (const std::string& named : {std::string("out"), file, std::string(kSource)}) {
      const files::Json found = difference(named);
      EXPECT_EQ(found["file"], file) << named << found;
      EXPECT_EQ(found["line"], line) << named << found;
    }
  }

  std::size_t line_of(const std::string& file, const std::string& text) {
    const std::string all = read_text(folder_ / file);
    const std::size_t at = all.find(text);
    EXPECT_NE(at, std::string::npos) << text;
    return 1 + static_cast<std::size_t>(
                   std::count(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
  }
};

TEST_F(Match, EveryFileOfAnExportIsComparedAndNamed) {
  for (const std::string named : {"out", "out/swarmcert_network.cpp", "out/nn/mlp.h"}) {
    const Outcome outcome = run("swarmcert match network.toml " + named + " -q --force --json match.json");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    const files::Json json = files::parse_json(read_text(folder_ / "match.json"), "match.json");
    EXPECT_EQ(json["equal"], true);
    EXPECT_EQ(json["first_difference"], nullptr);
    std::size_t files = 0;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "out"))
      files += entry.is_regular_file() ? 1 : 0;
    EXPECT_EQ(json["files"].size(), files) << json;
    EXPECT_EQ(files, 7u);
  }
}

TEST_F(Match, LineEndsOfOtherSystemsAreNoDifferenceAndOtherWhiteSpaceIs) {
  std::string text = read_text(folder_ / kSource), crlf;
  for (const char c : text) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  write_text(folder_ / kSource, crlf);
  EXPECT_EQ(run("swarmcert match network.toml out").exit_code, 0);
  write_text(folder_ / kSource, text + "\n");
  const files::Json longer = difference("out");
  EXPECT_NE(longer["what"].get<std::string>().find("continues after the end of the export"),
            std::string::npos);
  write_text(folder_ / kSource, text.substr(0, text.size() / 2));
  EXPECT_NE(difference("out")["what"].get<std::string>().find("ends here"), std::string::npos);
}

TEST_F(Match, FindsTheTrueTextInAnInactiveBranchBesideAChangedCopy) {
  const std::string text = read_text(folder_ / kSource);
  std::string changed = text;
  const std::size_t digit = changed.find("p-", changed.find("swarmcert_rho_small_2 = {")) - 1;
  changed[digit] = changed[digit] == '2' ? '4' : '2';
  write_text(folder_ / kSource, "#if 0\n" + text + "#endif\n" + changed);
  expect_found(kSource, 1);
  write_text(folder_ / kSource, text + "#if 0\n#endif\n");
  expect_found(kSource, 1 + static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')));
}

TEST_F(Match, FindsADoubledScaleAFlippedSignAndAChangedEvaluator) {
  const std::string scale = "kNewtonPerUnit = 0x1.41743ep-7f";  // 9.81e-3 as float32
  const std::string header = read_text(folder_ / kHeader);
  const std::size_t line = line_of(kHeader, scale);
  replace(kHeader, scale, "kNewtonPerUnit = 0x1.41743ep-6f");
  expect_found(kHeader, line);
  write_text(folder_ / kHeader, header);

  const std::string source = read_text(folder_ / kSource);
  const std::size_t sign = line_of(kSource, "*force_N = rounded");
  replace(kSource, "*force_N = rounded", "*force_N = -rounded");
  expect_found(kSource, sign);
  write_text(folder_ / kSource, source);

  for (const std::string name : {"arithmetic", "deep_set", "dense_layer", "mlp"}) {
    const std::string file = "out/nn/" + name + ".h";
    const std::string text = read_text(folder_ / file);
    const std::size_t once = line_of(file, "#pragma once");
    replace(file, "#pragma once", "#pragma  once");
    expect_found(file, once);
    write_text(folder_ / file, text);
  }
  EXPECT_EQ(run("swarmcert match network.toml out").exit_code, 0) << "the test did not restore the export";
}

TEST_F(Match, FindsWhatIsMissingOrAdditional) {
  write_text(folder_ / "out/nn/deep_set.hpp", "");
  EXPECT_EQ(difference("out")["file"], "out/nn/deep_set.hpp");
  fs::rename(folder_ / "out/nn/deep_set.hpp",
             folder_ / "out/cstdint");  // would be picked up by #include <cstdint>
  EXPECT_EQ(difference("out")["file"], "out/cstdint");
  fs::remove(folder_ / "out/cstdint");
  fs::rename(folder_ / "out/nn/mlp.h", folder_ / "mlp.h");
  EXPECT_EQ(difference("out")["file"], "out/nn/mlp.h");
  expect_match(kSource, 0, {"not covered: out/nn/mlp.h, which is not there"});
  EXPECT_EQ(run("swarmcert match network.toml flights").exit_code, 3);
  fs::create_directory(folder_ / "empty");
  expect_match("empty", 3, {"contains no file written by swarmcert export"});
}

TEST_F(Match, OneFileAwayFromTheOthersIsComparedAloneAndSaysSo) {
  for (const std::string name : {"copy.cpp", "swarmcert_network.cpp"}) {
    fs::copy_file(folder_ / kSource, folder_ / name);
    expect_match(name, 0, {"equal", "all 468 weights", "not covered: "});
    replace(name, "neighbours[j] = {vector.inputs[j]", "neighbours[j] = {vector.inputs[0]");
    expect_match(name, 1, {name + ", line", "vector.inputs[0]"});
  }
}

TEST_F(Match, ReadsTheParametersOfTheExportAndHoldsTheCertificateAgainstTheOneThatIsGiven) {
  ASSERT_EQ(run("swarmcert certify network.toml --method product -o cert.json -q").exit_code, 0);
  ASSERT_EQ(
      run("swarmcert export network.toml --certificate cert.json --most-neighbours 3 --seed 77 -o other -q")
          .exit_code,
      0);
  expect_match("other", 0, {"not covered: whether the certificate"});
  expect_match("other --certificate cert.json", 0, {"equal"});
  replace("cert.json", "\"schema\"", "\"note\": 1, \"schema\"");
  expect_match("other --certificate cert.json", 1, {"was exported with the certificate"});
  // Everything in the export has to agree with the stated parameters.
  replace("other/swarmcert_network.h", "kMostNeighbours = 3", "kMostNeighbours = 4");
  expect_match("other", 1, {"kMostNeighbours = 4"});
  replace("other/swarmcert_network.h", "kMostNeighbours = 4", "kMostNeighbours = 3");
  replace("other/swarmcert_network.h", "seed 77", "seed 78");
  expect_match("other", 1, {"swarmcert_network.cpp, line"});
  replace("other/swarmcert_network.h", "golden_vectors 16, seed 78", "golden_vectors 0, seed 77");
  expect_match("other", 1, {"golden_vectors 16"});
}

TEST_F(Match, OtherSourceIsEqualOnlyIfItHoldsNothingButTheWeights) {
  const auto decimal = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", value);
    return std::string(text);
  };
  std::string type = "struct R {", object = "static const struct R weights_rho = {";
  for (const files::Layer& layer : weights("rho.small").layers) {
    type += " float " + layer.name + "_weight[" + std::to_string(layer.inputs) + "][" +
            std::to_string(layer.outputs) + "]; float " + layer.name + "_bias[" +
            std::to_string(layer.outputs) + "];";
    object += "\n." + layer.name + "_weight = {";
    for (int j = 0; j < layer.inputs; ++j) {
      object += "{";
      for (int i = 0; i < layer.outputs; ++i)
        object += decimal(layer.weights[static_cast<std::size_t>(i * layer.inputs + j)]) + ", ";
      object += "}, ";
    }
    object += "},\n." + layer.name + "_bias = {";
    for (const double bias : layer.biases) object += decimal(bias) + ", ";
    object += "},";
  }
  const std::string text = type + " };\n" + object + "\n};\n";
  const auto expect = [&](const std::string& contents, int exit_code, const std::string& word) {
    write_text(folder_ / "weights.c", contents);
    const Outcome outcome = run("swarmcert match rho.small.safetensors weights.c");
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.output;
    EXPECT_NE(outcome.output.find(word), std::string::npos) << word << " in\n" << outcome.output;
  };
  expect("#include <x.h>\n/* generated */\n" + text, 0, "not covered: the code that reads these weights");
  std::string changed = text;
  changed.replace(changed.find("fc1_bias = {") + 12, 1,
                  changed[changed.find("fc1_bias = {") + 12] == '-' ? " " : "-");
  expect(changed, 1, "fc1 bias[0]");
  expect("#if 0\n" + text + "#endif\n" + changed, 4, "preprocessor");
  expect("  #  define float int\n" + text, 4, "preprocessor");
  expect("// \\\n" + text, 4, "continued");
  expect(text + "int x = 1;\n", 4, "not checked");
  std::string other = changed;
  for (const auto& [from, to] : {std::pair("struct R {", "struct S {"), {"struct R w", "struct S other_w"}})
    other.replace(other.find(from), std::string(from).size(), to);
  expect(text + other, 4, "which is not in the network");
}

TEST_F(Match, AProgramForCortexMIsRunAndAChangedScaleSignOrEvaluatorInItIsFound) {
  if (!tests::has_cortex_m_tools()) GTEST_SKIP() << "needs arm-none-eabi-g++ and qemu-system-arm";
  const auto build = [&] {
    const Outcome built =
        run(tests::cortex_m_build("-Iout out/swarmcert_network.cpp program.cpp", "program.elf"));
    ASSERT_EQ(built.exit_code, 0) << built.output;
  };
  build();
  // Two kinds of vehicles, 64 vectors each.
  expect_match("program.elf", 0, {"equal", "128 golden vectors", "not covered: which code calls"});
  expect_match("program.elf --most-neighbours 9", 0, {"equal"});
  expect_match("program.elf --most-neighbours 11", 1, {"with 11 neighbours", "status 1"});

  int found = 0;
  const std::pair<std::string, std::pair<std::string, std::string>> changes[] = {
      {kHeader, {"kNewtonPerUnit = 0x1.41743ep-7f", "kNewtonPerUnit = 0x1.417440p-7f"}},
      {kSource, {"*force_N = rounded", "*force_N = -rounded"}},
      {kSource,
       {"static constexpr float lower[6] = {\n    -0x1p+0f",
        "static constexpr float lower[6] = {\n    -0x1p+1f"}},
      {"out/nn/dense_layer.h",
       {"const Scalar zero = unknown;", "const Scalar zero = unknown + Scalar(0x1p-20);"}}};
  for (const auto& [file, change] : changes) {
    const std::string text = read_text(folder_ / file);
    if (text.find(change.first) == std::string::npos) {
      ADD_FAILURE() << file << " has no " << change.first;
      continue;
    }
    replace(file, change.first, change.second);
    build();
    expect_match("program.elf", 1, {"different", "predict_force_z gives", "golden vector"});
    write_text(folder_ / file, text);
    ++found;
  }
  EXPECT_EQ(found, 4);
}

TEST_F(Match, AProgramThatCannotBeRunIsInconclusiveWithTheReason) {
  if (!tests::has_cortex_m_tools()) GTEST_SKIP() << "needs arm-none-eabi-g++ and qemu-system-arm";
  const Outcome built = run(
      tests::cortex_m_build("-Iout out/swarmcert_network.cpp program.cpp", "program.elf") +
      " && arm-none-eabi-strip -o stripped.elf program.elf && " +
      "arm-none-eabi-g++ -std=c++17 -mcpu=cortex-m4 -mthumb -Iout -c out/swarmcert_network.cpp -o object.o");
  ASSERT_EQ(built.exit_code, 0) << built.output;
  expect_match("stripped.elf", 4, {"inconclusive", "not checked", "no symbol"});
  expect_match("object.o", 4, {"not checked", "before it is linked"});
  // A PATH that contains the tool but not QEMU.
  const Outcome without =
      run("PATH=$(dirname $(command -v swarmcert)) swarmcert match network.toml program.elf");
  EXPECT_EQ(without.exit_code, 4) << without.output;
  EXPECT_NE(without.output.find("qemu-system-arm is not installed"), std::string::npos) << without.output;
  // Code that does not return: a fault at its first instruction.
  const std::string text = read_text(folder_ / kSource);
  replace(kSource, "*force_N = 0.0f;\n", "*force_N = 0.0f; asm volatile(\"udf #0\");\n");
  ASSERT_EQ(
      run(tests::cortex_m_build("-Iout out/swarmcert_network.cpp program.cpp", "program.elf")).exit_code, 0);
  expect_match("program.elf", 4, {"not checked", "faulted"});
}

}  // namespace
}  // namespace swarmcert
