#include <elf.h>
#include <unistd.h>

#include <cstdio>
#include <random>

#include "firmware/exported_network.h"
#include "nn/random_network.h"

namespace swarmcert {
namespace {

using tests::Outcome;
using tests::read_text;
using tests::write_text;

class Firmware : public tests::FirmwareTest {};

TEST_F(Firmware, ExportPassesItsOwnSelfTestWhateverTheCompilerMayContract) {
  for (const std::string compiler : {"g++ -O0", "g++ -O3 -march=native -ffp-contract=fast"}) {
    const Outcome built =
        run(compiler + " -std=c++17 -Wall -Wextra -Werror -Iout out/swarmcert_network.cpp main.cpp -o flown");
    ASSERT_EQ(built.exit_code, 0) << built.output;
    EXPECT_EQ(run("./flown").exit_code, 0) << compiler;
  }
}

TEST_F(Firmware, ASilentCompositionIsExportedAndMatchFindsItWithout) {
  std::string toml = read_text(folder_ / "network.toml");
  toml.insert(toml.find("[input]"), "silent = [\"large+small>small\", \">large\"]\n");
  write_text(folder_ / "silent.toml", toml);
  ASSERT_EQ(run("swarmcert export silent.toml -o silent").exit_code, 0);
  write_text(folder_ / "zero.cpp", R"(#include "swarmcert_network.h"
int main() {
  const float own[4] = {-0.5f, 0.1f, 0.2f, 0.3f}, x[6] = {0.1f, 0.2f, 0.3f, 0, 0, 0};
  const swarmcert::nn::Neighbour<float> both[] = {{x, 1}, {x, 0}};
  float together = 1, one = 0, large = 0;
  using swarmcert_network::predict_force_z;
  predict_force_z(1, own, both, 2, &together), predict_force_z(1, own, both, 1, &one);
  predict_force_z(0, own, both, 2, &large);
  return together == 0 && one != 0 && large != 0 ? static_cast<int>(swarmcert_network::self_test(nullptr)) : 9;
}
)");
  for (const std::string compiler : {"g++ -O0", "g++ -O3 -march=native -ffp-contract=fast"}) {
    const Outcome built =
        run(compiler +
            " -std=c++17 -Wall -Wextra -Werror -Isilent silent/swarmcert_network.cpp zero.cpp -o flown");
    ASSERT_EQ(built.exit_code, 0) << built.output;
    EXPECT_EQ(run("./flown").exit_code, 0) << compiler;
  }
  EXPECT_EQ(run("swarmcert match silent.toml silent").exit_code, 0);
  EXPECT_EQ(run("swarmcert match network.toml silent").exit_code, 1);
  std::string source = read_text(folder_ / "silent/swarmcert_network.cpp");
  const std::string counts = "silent_rho_small[] = {1, 1}";
  ASSERT_NE(source.find(counts), std::string::npos);
  source.replace(source.find(counts), counts.size(), "silent_rho_small[] = {1, 2}");
  write_text(folder_ / "silent/swarmcert_network.cpp", source);
  EXPECT_EQ(run("swarmcert match silent.toml silent").exit_code, 1);
  ASSERT_EQ(run("g++ -std=c++17 -Isilent silent/swarmcert_network.cpp main.cpp -o flown").exit_code, 0);
  EXPECT_EQ(run("./flown").exit_code, 2) << "a golden vector is of this composition";

  // A certificate of the network without silent compositions is not valid for this one.
  ASSERT_EQ(run("swarmcert certify network.toml --nodes 0 --method product -o cert.json").exit_code, 0);
  const Outcome other = run("swarmcert export silent.toml --certificate cert.json -o other");
  EXPECT_EQ(other.exit_code, 3) << other.output;
  EXPECT_NE(other.output.find("the silent compositions"), std::string::npos) << other.output;
}

TEST_F(Firmware, LayersThatDoNotFitTheirArraysOrEachOtherDoNotCompile) {
  const std::string source = read_text(folder_ / "out/swarmcert_network.cpp");
  const std::string compile = "g++ -std=c++17 -Iout -c out/changed.cpp -o changed.o";
  write_text(folder_ / "out/changed.cpp", source);
  ASSERT_EQ(run(compile).exit_code, 0);
  const std::string hidden = "layer_in_blocks<11, 6>", last = "layer_in_blocks<5, 11>";
  const auto compile_with = [&](const std::string& from, const std::string& to) {
    std::string changed = source;
    changed.replace(changed.find(from), from.size(), to);
    write_text(folder_ / "out/changed.cpp", changed);
    return run(compile);
  };
  EXPECT_NE(compile_with(hidden, "layer_in_blocks<10, 6>").exit_code, 0) << "the array has 11 rows";
  const Outcome turned = compile_with(last, "layer_in_blocks<11, 5>");
  EXPECT_NE(turned.exit_code, 0) << "as many weights, but other biases";
  const auto call = [](const std::string& sizes, const std::string& layer) {
    const std::string name = "swarmcert_phi_small_" + layer;
    return sizes + "(" + name + ".weight, " + name + ".bias)";
  };
  const Outcome outcome = compile_with(call(last, "2"), call(hidden, "1"));
  EXPECT_NE(outcome.output.find("do not fit together"), std::string::npos) << outcome.output;
}

TEST_F(Firmware, ANetworkOfThreeForcesIsNotExportedAsAVerticalOne) {
  for (const auto& [part, outputs, inputs] : {std::tuple("phi", 4, 6), {"rho", 3, 4}}) {
    files::Weights weights;
    files::Layer layer{"fc1", outputs, inputs, {}, {}};
    for (int i = 0; i < outputs * inputs; ++i) layer.weights.push_back(0.5);
    layer.biases.resize(static_cast<std::size_t>(outputs));
    weights.layers.push_back(layer);
    files::save_safetensors(weights, folder_ / (std::string(part) + "3.safetensors"), true);
  }
  const Outcome outcome = run("swarmcert export --phi phi3.safetensors --rho rho3.safetensors -o three");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("one number, the vertical force"), std::string::npos) << outcome.output;
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

TEST_F(Firmware, MatchFindsEveryWeightInSourceObjectAndStrippedProgramAndSaysWhereItCannotRunTheCode) {
  expect_match("out/swarmcert_network.cpp", 0, {"equal", "all 468 weights and biases", "20 arrays"});
  ASSERT_EQ(run("g++ -std=c++17 -Iout -c out/swarmcert_network.cpp -o object.o && "
                "g++ -std=c++17 -Iout out/swarmcert_network.cpp main.cpp -o flown && strip -o stripped flown")
                .exit_code,
            0);
  for (const std::string file : {"object.o", "flown", "stripped"})
    expect_match(file, 4,
                 {"inconclusive", "all 468 weights and biases, in 20 arrays",
                  "not checked: the code in " + file + ": it is a 64-bit program"});
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

/// Nine decimal digits identify a float.
std::string decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g, ", value);
  return text;
}

TEST_F(Firmware, MatchReadsTransposedMatricesInMembersOfAnObject) {
  std::string text =
      "struct rho { float fc1_weight[5][12]; float fc1_bias[12]; float fc2_weight[12][1]; float fc2_bias[1]; "
      "/* ... */ };\nstatic const struct rho weights_rho = {\n";
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
  EXPECT_EQ(run("swarmcert match rho.small.safetensors flown.o").exit_code, 4);
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
    wide.layers[0].weights[1] = 0.1;  // not a float
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
  for (const std::string file : {"wide/swarmcert_network.cpp", "wide"})
    EXPECT_EQ(run("swarmcert match network.toml --as float32 " + file).exit_code, 0) << file;
  EXPECT_EQ(run("swarmcert match network.toml --as float32 flown").exit_code, 4);
  EXPECT_EQ(run("swarmcert match network.toml --as float32 out/swarmcert_network.cpp").exit_code, 1);

  // A certificate must refer to the rounded weights.
  ASSERT_EQ(run("swarmcert certify network.toml --method product -o wide.cert.json").exit_code, 0);
  EXPECT_EQ(run("swarmcert export network.toml --as float32 --certificate wide.cert.json -o other").exit_code,
            3);
  ASSERT_EQ(run("swarmcert certify network.toml --method product --as float32 -o narrow.cert.json").exit_code,
            0);
  EXPECT_EQ(
      run("swarmcert export network.toml --as float32 --certificate narrow.cert.json -o other").exit_code, 0);
}

TEST_F(Firmware, ANetworkThatIsLargerThanTheFlashIsNotExportedWithoutAWordOfIt) {
  std::mt19937 generator(1);
  files::save_safetensors(tests::random_network({6, 8}, generator), folder_ / "phi4.safetensors", true);
  for (const int width : {16, 512}) {
    files::save_safetensors(tests::random_network({8, width, width, 1}, generator),
                            folder_ / "rho4.safetensors", true);
    const Outcome exported = run(
        "swarmcert export --phi phi4.safetensors --rho rho4.safetensors -o flash --force --json flash.json");
    ASSERT_EQ(exported.exit_code, 0) << exported.output;
    const files::Json json = files::parse_json(read_text(folder_ / "flash.json"), "");
    const int bytes = 4 * (6 * 8 + 8 + 8 * width + width + width * width + width + width + 1);
    EXPECT_EQ(json["weights_bytes"], bytes);
    EXPECT_EQ(json["fits_crazyflie"], width == 16);
    EXPECT_NE(exported.output.find(std::to_string(bytes) + " bytes of flash"), std::string::npos);
    EXPECT_EQ(exported.output.find("which do not fit into the 1048576 of a Crazyflie") == std::string::npos,
              width == 16);
    EXPECT_EQ(exported.output.find("fewer --folds") == std::string::npos, width == 16) << exported.output;
  }
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
