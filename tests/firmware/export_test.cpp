#include <elf.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>

#include "analysis/run.h"
#include "nn/base/json.h"
#include "nn/base/random.h"
#include "nn/weights/network.h"

namespace swarmcert {
namespace {

using tests::Outcome;
using tests::read_text;
using tests::write_text;

/// Exports a network of two kinds with ground and clamp, and compiles what came out.
class Firmware : public testing::Test {
 protected:
  void SetUp() override {
    files::Random random(3);
    std::string toml =
        "schema = \"swarmcert/network/1\"\noutput = { quantity = \"force_z\", unit = \"gf\" }\n[input]\n"
        "order = [\"dp_x_m\",\"dp_y_m\",\"dp_z_m\",\"dv_x_m_s\",\"dv_y_m_s\",\"dv_z_m_s\"]\n"
        "clamp = { lower = [-1,-1,-1,-2,-2,-2], upper = [1,1,1,2,2,2] }\n";
    const std::vector<std::pair<std::string, std::vector<int>>> parts = {{"phi.ground", {4, 9, 5}},
                                                                         {"phi.small", {6, 11, 5}},
                                                                         {"phi.large", {6, 8, 5}},
                                                                         {"rho.small", {5, 12, 1}},
                                                                         {"rho.large", {5, 7, 1}}};
    for (const auto& [part, sizes] : parts) {
      files::Weights weights;
      for (std::size_t k = 1; k < sizes.size(); ++k) {
        files::Layer layer{"fc" + std::to_string(k), sizes[k], sizes[k - 1], {}, {}};
        const auto number = [&] { return static_cast<double>(static_cast<float>(random.symmetric())); };
        for (int i = 0; i < layer.outputs * layer.inputs; ++i) layer.weights.push_back(number());
        for (int i = 0; i < layer.outputs; ++i) layer.biases.push_back(number());
        weights.layers.push_back(layer);
      }
      files::save_safetensors(weights, folder_ / (part + ".safetensors"), true);
      toml += "[" + part + "]\nweights = \"" + part + ".safetensors\"\n";
    }
    write_text(folder_ / "network.toml", toml);
    write_text(folder_ / "main.cpp",
               "#include \"swarmcert_network.h\"\n"
               "int main() { return static_cast<int>(swarmcert_network::self_test(nullptr)); }\n");
    const Outcome outcome = run("swarmcert export network.toml -o out");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  }

  Outcome run(const std::string& command) { return tests::run_shell(command, folder_.path()); }

  /// "swarmcert match network.toml FILE", its exit code, and whether the text holds each of `words`.
  void expect_match(const std::string& file, int exit_code, const std::vector<std::string>& words) {
    const Outcome outcome = run("swarmcert match network.toml " + file);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.output;
    for (const std::string& word : words)
      EXPECT_NE(outcome.output.find(word), std::string::npos) << word << " in\n" << outcome.output;
  }

  files::Weights weights(const std::string& part) {
    return files::load_weights(folder_ / (part + ".safetensors"));
  }

  /// Writes `file` again with one bit of a stored float flipped. False if the float is not in it.
  bool flip_last_bit(const std::string& file, const std::string& changed, double value) {
    std::string bytes = read_text(folder_ / file);
    const float narrow = static_cast<float>(value);
    std::string pattern(4, '\0');
    std::memcpy(pattern.data(), &narrow, 4);
    const std::size_t at = bytes.find(pattern);
    if (at == std::string::npos) return false;
    bytes[at] = static_cast<char>(bytes[at] ^ 1);
    write_text(folder_ / changed, bytes);
    return true;
  }

  tests::ScratchFolder folder_;
};

TEST_F(Firmware, ExportPassesItsOwnSelfTestWhateverTheCompilerMayContract) {
  for (const std::string compiler : {"g++ -O0", "g++ -O3 -march=native -ffp-contract=fast"}) {
    const Outcome built =
        run(compiler + " -std=c++17 -Wall -Wextra -Werror -Iout out/swarmcert_network.cpp main.cpp -o flown");
    ASSERT_EQ(built.exit_code, 0) << built.output;
    EXPECT_EQ(run("./flown").exit_code, 0) << compiler;
  }
}

TEST_F(Firmware, SelfTestFailsForAChangedWeight) {
  std::string source = read_text(folder_ / "out/swarmcert_network.cpp");
  const std::size_t array = source.find("swarmcert_rho_small_2 = {");
  const std::size_t digit = source.find("p-", array) - 1;
  source[digit] = source[digit] == '2' ? '4' : '2';
  write_text(folder_ / "out/swarmcert_network.cpp", source);
  ASSERT_EQ(run("g++ -std=c++17 -Iout out/swarmcert_network.cpp main.cpp -o flown").exit_code, 0);
  EXPECT_EQ(run("./flown").exit_code, 2);
  expect_match("out/swarmcert_network.cpp", 1, {"different", "rho:small", "weight[0][0]", "line"});
}

TEST_F(Firmware, MatchFindsEveryWeightInSourceObjectAndStrippedProgram) {
  expect_match("out/swarmcert_network.cpp", 0, {"equal", "all 468 weights and biases", "20 arrays"});
  ASSERT_EQ(run("g++ -std=c++17 -Iout -c out/swarmcert_network.cpp -o object.o && "
                "g++ -std=c++17 -Iout out/swarmcert_network.cpp main.cpp -o flown && strip -o stripped flown")
                .exit_code,
            0);
  for (const std::string file : {"object.o", "flown", "stripped"}) expect_match(file, 0, {"equal"});
}

TEST_F(Firmware, MatchAndSelfTestFindOneFlippedBitOfAnyArrayInAnElf) {
  ASSERT_EQ(run("g++ -std=c++17 -Iout -c out/swarmcert_network.cpp -o object.o && "
                "g++ -std=c++17 -Iout -c main.cpp -o main.o && g++ object.o main.o -o flown && ./flown")
                .exit_code,
            0);
  const auto expect_self_test_to_fail = [&] {
    const int verdict = run("g++ changed.o main.o -o flown && ./flown").exit_code;
    EXPECT_TRUE(verdict == 2 || verdict == 3) << verdict;  // a golden vector, or the hash of the weights
  };
  int tried = 0;
  for (const std::string part : {"phi.ground", "phi.small", "phi.large", "rho.small", "rho.large"}) {
    for (const files::Layer& layer : weights(part).layers) {
      ASSERT_TRUE(flip_last_bit("object.o", "changed.o", layer.weights.back()));
      expect_match("changed.o", 1, {"different", layer.name + " weight[", "swarmcert_", "address"});
      expect_self_test_to_fail();
      ASSERT_TRUE(flip_last_bit("object.o", "changed.o", layer.biases.back()));
      expect_match("changed.o", 1, {"different", layer.name + " bias[", "swarmcert_", "address"});
      expect_self_test_to_fail();
      tried += 2;
    }
  }
  EXPECT_EQ(tried, 20);
}

/// Nine decimal digits give a float back.
std::string decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g, ", value);
  return text;
}

TEST_F(Firmware, MatchReadsTransposedMatricesInMembersOfAnObject) {
  std::string text =
      "struct rho { float fc1_weight[5][12]; /* ... */ };\nstatic const struct rho weights_rho = {\n";
  for (const files::Layer& layer : weights("rho.small").layers) {
    text += "." + layer.name + "_weight = {";
    for (int j = 0; j < layer.inputs; ++j) {
      text += "{";
      for (int i = 0; i < layer.outputs; ++i) text += decimal(layer.weights[i * layer.inputs + j]);
      text += "},\n";
    }
    text += "},\n." + layer.name + "_bias = {";
    for (const double bias : layer.biases) text += decimal(bias);
    text += "},\n";
  }
  write_text(folder_ / "generated.c", text + "};\n");
  const Outcome same = run("swarmcert match rho.small.safetensors generated.c");
  EXPECT_EQ(same.exit_code, 0) << same.output;
  EXPECT_NE(same.output.find("4 arrays"), std::string::npos) << same.output;

  const std::size_t bias = text.find("fc2_bias = {") + 12;
  text.replace(bias, 3, "0.5");
  write_text(folder_ / "changed.c", text + "};\n");
  const Outcome changed = run("swarmcert match rho.small.safetensors changed.c");
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_NE(changed.output.find("fc2 bias[0]"), std::string::npos) << changed.output;
}

TEST_F(Firmware, MatchReadsAnElfOfTheAuthorsLayoutAndNamesTheSymbol) {
  std::string text =
      "struct rho { float w1[5][12]; float b1[12]; float w2[12][1]; float b2[1]; };\n"
      "const struct rho weights_rho = {\n";
  for (const files::Layer& layer : weights("rho.small").layers) {
    text += "{";
    for (int j = 0; j < layer.inputs; ++j) {
      text += "{";
      for (int i = 0; i < layer.outputs; ++i) text += decimal(layer.weights[i * layer.inputs + j]);
      text += "},";
    }
    text += "}, {";
    for (const double bias : layer.biases) text += decimal(bias);
    text += "},\n";
  }
  write_text(folder_ / "flown.c", text + "};\n");
  ASSERT_EQ(run("gcc -c flown.c -o flown.o && strip -g flown.o").exit_code, 0);
  EXPECT_EQ(run("swarmcert match rho.small.safetensors flown.o").exit_code, 0);
  ASSERT_TRUE(flip_last_bit("flown.o", "changed.o", weights("rho.small").layers[0].weights[3]));
  const Outcome changed = run("swarmcert match rho.small.safetensors changed.o");
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_NE(changed.output.find("fc1 weight[0][3]"), std::string::npos) << changed.output;
  EXPECT_NE(changed.output.find("weights_rho, address 0x"), std::string::npos) << changed.output;
}

TEST_F(Firmware, Float64NetworksAreExportedAsFloat32WhereAskedAndNeverSilently) {
  for (const std::string part : {"phi.ground", "phi.small", "phi.large", "rho.small", "rho.large"}) {
    files::Weights wide = weights(part);
    wide.precision = files::Precision::kFloat64;
    wide.layers[0].weights[1] = 0.1;  // no float
    files::save_safetensors(wide, folder_ / (part + ".safetensors"), true);
  }
  for (const std::string command :
       {"export network.toml -o wide", "match network.toml out/swarmcert_network.cpp"}) {
    const Outcome refused = run("swarmcert " + command);
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_NE(refused.output.find("--as float32"), std::string::npos) << refused.output;
  }
  const Outcome exported = run("swarmcert export network.toml --as float32 -o wide --json wide.json");
  ASSERT_EQ(exported.exit_code, 0) << exported.output;
  EXPECT_EQ(files::parse_json(read_text(folder_ / "wide.json"), "")["as"], "float32");
  ASSERT_EQ(run("g++ -std=c++17 -Iwide wide/swarmcert_network.cpp main.cpp -o flown").exit_code, 0);
  EXPECT_EQ(run("./flown").exit_code, 0);
  for (const std::string file : {"wide/swarmcert_network.cpp", "flown"})
    EXPECT_EQ(run("swarmcert match network.toml --as float32 " + file).exit_code, 0) << file;
  EXPECT_EQ(run("swarmcert match network.toml --as float32 out/swarmcert_network.cpp").exit_code, 1);

  // A certificate must be about the rounded weights.
  ASSERT_EQ(run("swarmcert certify network.toml --method product -o wide.cert.json").exit_code, 0);
  EXPECT_EQ(run("swarmcert export network.toml --as float32 --certificate wide.cert.json -o other").exit_code,
            3);
  ASSERT_EQ(run("swarmcert certify network.toml --method product --as float32 -o narrow.cert.json").exit_code,
            0);
  EXPECT_EQ(
      run("swarmcert export network.toml --as float32 --certificate narrow.cert.json -o other").exit_code, 0);
}

TEST_F(Firmware, AChangedWeightFileFailsTheCheckerAndExportWithItsCertificate) {
  ASSERT_EQ(run("swarmcert certify network.toml --method product -o cert.json").exit_code, 0);
  EXPECT_EQ(run("swarmcert check cert.json network.toml").exit_code, 0);
  EXPECT_EQ(run("swarmcert export network.toml --certificate cert.json -o certified").exit_code, 0);
  ASSERT_TRUE(flip_last_bit("phi.small.safetensors", "phi.small.safetensors",
                            weights("phi.small").layers[1].weights[2]));
  EXPECT_EQ(run("swarmcert check cert.json network.toml").exit_code, 1);
  const Outcome refused = run("swarmcert export network.toml --certificate cert.json -o changed");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.output.find("phi:small"), std::string::npos) << refused.output;
  expect_match("out/swarmcert_network.cpp", 1, {"phi:small", "fc2 weight[0][2]"});
}

TEST_F(Firmware, FilesThatAreNoElfOfAMicrocontrollerOrAHostAreBadInput) {
  ASSERT_EQ(run("g++ -std=c++17 -Iout -c out/swarmcert_network.cpp -o object.o").exit_code, 0);
  std::string big_endian = read_text(folder_ / "object.o");
  big_endian[5] = 2;
  write_text(folder_ / "big_endian.o", big_endian);
  expect_match("big_endian.o", 3, {"big_endian.o", "little-endian"});
  std::string of_no_class = read_text(folder_ / "object.o");
  of_no_class[4] = 7;
  write_text(folder_ / "class.o", of_no_class);
  expect_match("class.o", 3, {"neither 32 nor 64 bit"});
  write_text(folder_ / "firmware.bin", std::string(4096, '\x7f'));
  expect_match("firmware.bin", 3, {"firmware.bin", "ELF"});
  expect_match("missing.elf", 3, {"missing.elf"});
}

TEST_F(Firmware, AnElfWhoseSymbolsClaimMoreThanItHoldsIsRefusedBeforeItsCopiesFillTheMemory) {
  constexpr std::uint32_t kData = 1 << 16, kSymbols = 2000;
  Elf32_Ehdr header{};
  std::memcpy(header.e_ident, ELFMAG, SELFMAG);
  header.e_ident[EI_CLASS] = ELFCLASS32;
  header.e_ident[EI_DATA] = ELFDATA2LSB;
  header.e_shentsize = sizeof(Elf32_Shdr);
  header.e_shnum = 3;
  Elf32_Shdr sections[3] = {};
  sections[0].sh_type = SHT_PROGBITS;
  sections[0].sh_flags = SHF_ALLOC;
  sections[0].sh_offset = sizeof header;
  sections[0].sh_size = kData;
  sections[1].sh_type = SHT_SYMTAB;
  sections[1].sh_offset = sizeof header + kData;
  sections[1].sh_size = kSymbols * sizeof(Elf32_Sym);
  sections[1].sh_link = 2;
  sections[2].sh_type = SHT_STRTAB;
  sections[2].sh_offset = sizeof header;
  sections[2].sh_size = 8;
  header.e_shoff = sections[1].sh_offset + sections[1].sh_size;
  Elf32_Sym symbol{};
  symbol.st_info = STT_OBJECT;
  symbol.st_size = kData;
  const auto bytes_of = [](const auto& object) {
    return std::string(reinterpret_cast<const char*>(&object), sizeof object);
  };
  std::string elf = bytes_of(header) + std::string(kData, 'x');
  for (std::uint32_t i = 0; i < kSymbols; ++i) elf += bytes_of(symbol);
  write_text(folder_ / "overlapping.elf", elf + bytes_of(sections));
  expect_match("overlapping.elf", 3, {"symbols overlap"});
}

TEST_F(Firmware, DamagedElfsAreBadInputAndNeverACrash) {
  ASSERT_EQ(run("g++ -std=c++17 -Iout -c out/swarmcert_network.cpp -o object.o").exit_code, 0);
  const std::string whole = read_text(folder_ / "object.o");
  int refused = 0;
  for (std::size_t size = 4; size < whole.size(); size += whole.size() / 40) {
    write_text(folder_ / "cut.o", whole.substr(0, size));
    const Outcome outcome = run("swarmcert match network.toml cut.o");
    EXPECT_EQ(outcome.exit_code, 3) << size << "\n" << outcome.output;
    ++refused;
  }
  EXPECT_GE(refused, 40);
  write_text(folder_ / "empty.c", "int x;\n");
  expect_match("empty.c", 3, {"empty.c", "no initialiser with numbers"});
}

TEST_F(Firmware, ExportReplacesNothingWithoutForce) {
  const Outcome outcome = run("swarmcert export network.toml -o out");
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("--force"), std::string::npos);
  EXPECT_EQ(run("swarmcert export network.toml -o out --force").exit_code, 0);
}

}  // namespace
}  // namespace swarmcert
