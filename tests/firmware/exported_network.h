/// @file An exported network of two kinds with ground and clamp, and programs built from it.
#pragma once

#include <gtest/gtest.h>

#include <cstring>

#include "analysis/run.h"
#include "firmware/cortex_m_build.h"
#include "nn/base/json.h"
#include "nn/base/random.h"
#include "nn/weights/network.h"

namespace swarmcert::tests {

/// Exports a network of two kinds with ground and clamp, and compiles the export.
class FirmwareTest : public testing::Test {
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
    write_text(
        folder_ / "program.cpp",
        "#include \"swarmcert_network.h\"\n"
        "extern \"C\" int program() { return static_cast<int>(swarmcert_network::self_test(nullptr)); }\n");
    const Outcome outcome = run("swarmcert export network.toml -o out");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  }

  Outcome run(const std::string& command) { return run_shell(command, folder_.path()); }

  /// Expects the exit code of "swarmcert match network.toml FILE" and each of `words` in its output.
  void expect_match(const std::string& file, int exit_code, const std::vector<std::string>& words) {
    const Outcome outcome = run("swarmcert match network.toml " + file);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.output;
    for (const std::string& word : words)
      EXPECT_NE(outcome.output.find(word), std::string::npos) << word << " in\n" << outcome.output;
  }

  files::Weights weights(const std::string& part) {
    return files::load_weights(folder_ / (part + ".safetensors"));
  }

  /// Copies `file` to `changed` with one bit of the stored float `value` flipped. Returns false if `file` does not
  /// contain the float.
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

  ScratchFolder folder_;
};

}  // namespace swarmcert::tests
