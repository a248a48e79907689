#include "analysis/learning/trained_network.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "analysis/residuals/published_lag.h"
#include "nn/base/file_io.h"
#include "nn/training/deep_set_loss.h"
#include "nn/weights/function_id.h"
#include "nn/weights/record_samples.h"

namespace swarmcert::learning {
namespace {

namespace fs = std::filesystem;

constexpr int kRecordedSamples = 64;  ///< number per part
constexpr char kSamplesFile[] = "samples.json";

std::string file_of(const files::FunctionId& part) {
  return (part.is_phi() ? "phi_" : "rho_") + part.kind() + ".safetensors";
}

std::string network_toml(const LearningData& data, const files::GammaStatement& gamma,
                         const std::vector<std::string>& silent) {
  std::string text = "schema = \"swarmcert/network/1\"\n";
  if (!silent.empty())
    text += fmt::format("# Compositions (neighbours > vehicle) without a network.\nsilent = {}\n",
                        files::Json(silent).dump());
  text += fmt::format(
      "output = {{ quantity = \"{}\", unit = \"{}\" }}\n"
      "gamma = {{ value = {}, scope = \"{}\", mode = \"{}\" }}\n"
      "[input]\norder = [\"dp_x_m\", \"dp_y_m\", \"dp_z_m\", \"dv_x_m_s\", \"dv_y_m_s\", \"dv_z_m_s\"]\n",
      info(data.target).quantity, info(data.target).unit, gamma.value,
      gamma.scope == files::GammaStatement::Scope::kLayer ? "layer" : "network",
      gamma.mode == files::GammaStatement::Mode::kClip ? "clip" : "equal");
  for (const training::Part& part : data.layout.parts()) {
    text += fmt::format("[{}.{}]\nweights = \"{}\"\n", part.id.is_phi() ? "phi" : "rho", part.id.kind(),
                        file_of(part.id));
  }
  return text;
}

/// Writes outputs computed with the trainer's own arithmetic, so that a reader can verify that the files contain the
/// trained network.
void write_samples(const training::Layout& layout, const training::Vector& theta,
                   const files::Network& network, const std::string& path) {
  const files::PartOutput output = [&](const std::string& part, const std::vector<float>& input) {
    const Eigen::Map<const training::Vector> x(input.data(), static_cast<Eigen::Index>(input.size()));
    const training::Matrix y = part_output(layout, theta, layout.find(part), x);
    return std::vector<double>(y.data(), y.data() + y.size());
  };
  const auto samples = files::record_samples(network, output, kRecordedSamples, 1);
  files::write_file(path, files::to_text(files::samples_json(samples)), true);
}

}  // namespace

files::Network write_network(const LearningData& data, const training::Vector& theta,
                             const files::GammaStatement& gamma, const std::string& folder,
                             const std::vector<std::string>& silent) {
  const training::Layout& layout = data.layout;
  for (std::size_t p = 0; p < layout.parts().size(); ++p) {
    files::save_safetensors(layout.stored(theta, static_cast<int>(p)),
                            (fs::path(folder) / file_of(layout.parts()[p].id)).string(), true);
  }
  const std::string path = (fs::path(folder) / "network.toml").string();
  files::write_file(path, network_toml(data, gamma, silent), true);
  files::Network network = files::load_network({{}, path, "", ""});
  write_samples(layout, theta, network, (fs::path(folder) / kSamplesFile).string());
  return network;
}

namespace {

/// Residuals of the published signals include the lag of those signals, so it replaces every lag of the model.
void set_published_lag(stability::Model& model) {
  auto& effects = model.effects;
  effects.erase(std::remove_if(effects.begin(), effects.end(),
                               [](const stability::EffectSpec& effect) {
                                 return effect.name == "motor_lag" || effect.name == "delay";
                               }),
                effects.end());
  stability::EffectSpec lag;
  lag.name = "motor_lag";
  lag.parameters = {{"gain", 1}, {"tau_s", residuals::kPublishedLag_s}};
  effects.push_back(std::move(lag));
}

}  // namespace

void write_models(const residuals::Inputs& inputs, const training::Layout& layout, const std::string& folder,
                  bool with_network) {
  const auto write = [&](stability::Model model, const std::string& name) {
    if (inputs.rules.has_published_signals()) set_published_lag(model);
    stability::EffectSpec effect;
    effect.name = "deep_set";
    effect.network = "network.toml";
    if (with_network) model.effects.push_back(std::move(effect));
    files::write_file((fs::path(folder) / ("model-" + name + ".toml")).string(),
                      to_toml(model, {with_network ? "With the network in this folder."
                                                   : "Without the network in this folder: on the selecting "
                                                     "flights it is worse than none."}),
                      true);
  };
  const auto is_learned = [&layout](const std::string& kind) {
    return layout.find(files::FunctionId::rho(kind)) >= 0;
  };
  for (const stability::Model& model : inputs.models)
    if (is_learned(model.kind)) write(model, model.kind);
  if (inputs.vehicle_models.empty()) return;
  std::string fleet = "schema = \"swarmcert/flights/1\"\n";
  for (const auto& [vehicle, use] : inputs.fleet) {
    if (!is_learned(use.kind)) continue;
    const auto own = inputs.vehicle_models.find(vehicle);
    if (own != inputs.vehicle_models.end()) write(own->second, vehicle);
    fleet += fmt::format("\n[vehicle.{}]\nmodel = \"model-{}.toml\"\nuse = \"{}\"\n", vehicle,
                         own != inputs.vehicle_models.end() ? vehicle : use.kind,
                         use.position_only ? "position" : "all");
  }
  files::write_file((fs::path(folder) / "flights.toml").string(), fleet, true);
}

double Certified::largest() const {
  double result = 0;
  for (const auto& [function, upper] : set_bounds) result = std::max(result, upper);
  return result;
}

Certified write_certificate(const files::Network& network, const std::string& folder,
                            const lipschitz::CertifyOptions& options) {
  Certified certified;
  certified.found = lipschitz::certify(network, options);
  const std::string samples = (fs::path(folder) / kSamplesFile).string();
  if (fs::exists(samples)) {
    for (const auto& [part, recorded] : files::read_samples(samples, network))
      certified.found.samples.emplace(part, files::hold_against(network, part, recorded));
  }
  files::write_file((fs::path(folder) / "certificate.json").string(),
                    files::to_text(lipschitz::certificate(network, certified.found)), true);
  for (const lipschitz::CertifiedLayer& layer : certified.found.layers) {
    if (layer.respects_gamma && *layer.respects_gamma != lipschitz::Verdict::kProved)
      certified.gamma = *layer.respects_gamma;
  }
  for (const lipschitz::CertifiedBound& bound : certified.found.bounds) {
    if (bound.function.is_set())
      certified.set_bounds.emplace_back(bound.function.name(), bound.upper.value());
  }
  return certified;
}

}  // namespace swarmcert::learning
