#include "gate/release.h"

#include <algorithm>

#include "analysis/gate/outputs.h"
#include "data.h"
#include "firmware/cortex_m_build.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/base/random.h"
#include "nn/weights/functions.h"
#include "nn/weights/network.h"
#include "nn/weights/weights.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

using Tables = std::vector<std::pair<std::string, std::string>>;

/// A deep set of kind "small" whose layers keep gamma 3: small, so that proofs take milliseconds.
void write_network(const std::string& folder) {
  files::Random random(7);
  const std::pair<std::string, std::vector<int>> parts[] = {{"phi", {6, 10, 8}}, {"rho", {8, 10, 1}}};
  for (const auto& [part, sizes] : parts) {
    files::Weights weights;
    for (std::size_t k = 1; k < sizes.size(); ++k) {
      files::Layer layer{"fc" + std::to_string(k), sizes[k], sizes[k - 1], {}, {}};
      const auto number = [&] { return static_cast<double>(static_cast<float>(0.7 * random.symmetric())); };
      for (int i = 0; i < layer.outputs * layer.inputs; ++i) layer.weights.push_back(number());
      for (int i = 0; i < layer.outputs; ++i) layer.biases.push_back(number());
      weights.layers.push_back(layer);
    }
    files::save_safetensors(weights, folder + "/" + part + ".safetensors", true);
  }
}

void copy(const std::string& from, const std::string& to) {
  fs::create_directories(fs::path(to).parent_path());
  fs::copy_file(source_path(from), to, fs::copy_options::overwrite_existing);
}

}  // namespace

ReleaseFolder::ReleaseFolder() {
  for (const std::string name : {"network.toml", "box.toml"})
    copy("nn/networks/demo/" + name, folder_ / ("network/" + name));
  write_network(folder_ / "network");
  copy("controller/gains/composite.toml", folder_ / "gains.toml");
  copy("stability/models/crazyflie-small.toml", folder_ / "model.toml");
  copy("stability/bounds/swarms/published-pair.toml", folder_ / "swarm.toml");
  for (const std::string seed : {"1", "2"}) {
    const Outcome flown =
        run("swarmcert simulate random-walk --vehicles 1 --duration 12 --model model.toml --gains gains.toml "
            "-q --seed " +
            seed + " -o flights/" + seed);
    EXPECT_EQ(flown.exit_code, 0) << flown.output;
  }
  certify_again();
}

ReleaseFolder::ReleaseFolder(const ReleaseFolder& other) : has_elf_(other.has_elf_) {
  fs::copy(other.path(), folder_.path(), fs::copy_options::recursive);
}

void ReleaseFolder::certify_again() const {
  const Outcome outcome = run(
      "swarmcert certify network/network.toml --nodes 1 --blocks=position,velocity -q --force -o cert.json "
      "&& swarmcert export network/network.toml --certificate cert.json --force -q -o firmware");
  // A network that violates its gamma still has a certificate.
  EXPECT_TRUE(outcome.exit_code == 0 || fs::exists(folder_ / "cert.json")) << outcome.output;
  if (outcome.exit_code != 0) {
    const Outcome exported = run("swarmcert export network/network.toml --force -q -o firmware");
    EXPECT_EQ(exported.exit_code, 0) << exported.output;
  }
  build_elf();
  write_facts(21000);
}

void ReleaseFolder::build_elf() const {
  if (has_cortex_m_tools()) {
    write_text(
        folder_ / "program.cpp",
        "#include \"swarmcert_network.h\"\n"
        "extern \"C\" int program() { return static_cast<int>(swarmcert_network::self_test(nullptr)); }\n");
    const Outcome built =
        run(cortex_m_build("-Ifirmware firmware/swarmcert_network.cpp program.cpp", "firmware/network.elf"));
    EXPECT_EQ(built.exit_code, 0) << built.output;
    const_cast<ReleaseFolder*>(this)->has_elf_ = true;
  }
}

void ReleaseFolder::write_facts(int flash_bytes) const {
  files::NetworkArguments arguments;
  arguments.file = folder_ / "network/network.toml";
  const files::Network network = files::load_network(arguments);
  files::Json weights = files::Json::object();
  for (const auto& [part, stored] : files::parts(network))
    weights[part.name()] = {{"sha256", stored->sha256}};
  const auto us = [](double least, double most) {
    files::Json cost = {{"instructions", 1000}};
    cost["modelled_us"] = {least, most};
    return cost;
  };
  const files::Json stack = {{"bytes", 700}};
  files::Json facts = {{"schema", "swarmcert/firmware-facts/1"}};
  facts["network"] = {{"sha256", network.sha256}, {"weights", weights}};
  facts["parts"] = {{"phi:small", us(141.6, 147.9)}, {"rho:small", us(158.5, 165.1)}};
  facts["functions"] = {{"controller", us(40.4, 42.7)}};
  facts["stack"] = {{"network_task", stack}, {"controller", stack}, {"self_test", stack}};
  facts["flash_bytes"] = flash_bytes;
  facts["ram_bytes"] = 2000;
  files::write_file(folder_ / "facts.json", files::to_text(facts), true);
}

std::string ReleaseFolder::write_policy(const Tables& tables) const {
  std::string text =
      "schema = \"swarmcert/policy/1\"\n[release]\nnetwork = \"network/network.toml\"\ncertificate = "
      "\"cert.json\"\n"
      "box = \"network/box.toml\"\ngains = \"gains.toml\"\nmodel = \"model.toml\"\nswarm = \"swarm.toml\"\n"
      "source = \"firmware/swarmcert_network.cpp\"\nfacts = \"facts.json\"\nflights = [\"flights\"]\nlogs = "
      "2\n";
  if (has_elf_) text += "elf = \"firmware/network.elf\"\n";
  for (const auto& [name, body] : tables) text += "\n[" + name + "]\n" + body + "\n";
  write_text(folder_ / "policy.toml", text);
  return folder_ / "policy.toml";
}

std::string ReleaseFolder::policy(const Tables& change) const {
  Tables tables = {
      {"hashes", "\"gains.toml\" = \"" + files::sha256(read_text(folder_ / "gains.toml")) + "\""},
      {"certificate", ""},
      {"lipschitz",
       "max_joint_gf = 6\nmax_position_gf_m = 6\nmax_velocity_gf_s_m = 6\n"
       "functions = { \"phi:small\" = 30, \"rho:small\" = 40 }"},
      {"spectral_norms", ""},
      {"float32_error", "max_error_gf = 6e-5"},
      {"range", "max_abs_force_gf = 100\nmax_jump_gf = 400"},
      {"theorem", ""},
      {"tracking", "amplitude_N = 0.02\nguard_factor = 1.1\nmax_error_m = 0.03"},
      {"small_gain", "min_margin = 0.05"},
      {"match", ""},
      {"firmware_facts",
       "max_flash_bytes = 65536\nmax_ram_bytes = 8192\nmax_stack_bytes = 1000\n"
       "parts_us = { \"phi:small\" = 200 }\nfunctions_us = { controller = 60 }"},
      {"residual", "max_rmse_N = 0.03\nmin_records = 1000"},
      {"regression", "max_increase_percent = 2000"},
  };
  for (const auto& [name, body] : change) {
    const auto same = [&name = name](const auto& table) { return table.first == name; };
    const auto at = std::find_if(tables.begin(), tables.end(), same);
    if (body.empty()) {
      tables.erase(at);
    } else if (at == tables.end()) {
      tables.emplace_back(name, body);
    } else {
      at->second = body;
    }
  }
  return write_policy(tables);
}

std::string ReleaseFolder::policy_of(const std::vector<std::string>& tables) const {
  Tables some;
  for (const std::string& table : tables) {
    const std::size_t colon = table.find('\n');
    some.emplace_back(table.substr(0, colon), colon == std::string::npos ? "" : table.substr(colon + 1));
  }
  return write_policy(some);
}

gate::GateResult ReleaseFolder::judge(const std::string& policy, const std::string& baseline) const {
  gate::GateSettings settings;
  settings.jobs = 1;
  settings.baseline = baseline;
  return gate::run_gate(gate::read_policy(policy), settings);
}

std::vector<std::string> ReleaseFolder::files() const {
  std::vector<std::string> all;
  for (const gate::EvidenceFile& file : gate::evidence_files(gate::read_policy(policy()), "")) {
    if (file.role != "policy") all.push_back(fs::path(file.path).lexically_relative(folder_.path()).string());
  }
  return all;
}

std::vector<std::string> caught(const gate::GateResult& result) {
  std::vector<std::string> names;
  for (const gate::Check& check : result.checks) {
    const std::string table = check.name.substr(0, check.name.find('.'));
    if (check.verdict == gate::Verdict::kPass) continue;
    if (std::find(names.begin(), names.end(), table) == names.end()) names.push_back(table);
  }
  return names;
}

void change_tensor(const std::string& path, const std::string& layer, double factor, double offset) {
  files::Weights weights = files::load_weights(path);
  int changed = 0;
  for (files::Layer& one : weights.layers) {
    if (one.name != layer) continue;
    for (double& w : one.weights) w = static_cast<double>(static_cast<float>(w * factor));
    for (double& b : one.biases) b = static_cast<double>(static_cast<float>(b + offset));
    ++changed;
  }
  EXPECT_EQ(changed, 1) << path << " has no layer " << layer;
  files::save_safetensors(weights, path, true);
}

std::string told(const gate::GateResult& result) { return gate::to_table(result); }

}  // namespace swarmcert::tests
