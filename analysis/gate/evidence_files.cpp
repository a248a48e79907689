#include <algorithm>
#include <filesystem>

#include "analysis/firmware/match_export.h"
#include "analysis/gate/evidence.h"
#include "analysis/residuals/flight_set.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"
#include "stability/model.h"

namespace swarmcert::gate {
namespace {

class FileList {
 public:
  void add(const std::string& role, const std::string& path) {
    if (path.empty()) return;
    const auto same = [&path](const EvidenceFile& file) { return file.path == path; };
    if (std::none_of(files_.begin(), files_.end(), same)) files_.push_back({role, path});
  }

  void add_network(const std::string& role, const files::NetworkArguments& arguments) {
    add(role, arguments.file);
    add("weights", arguments.phi);
    add("weights", arguments.rho);
    try {
      const files::Network network = files::load_network(arguments);
      for (const auto& [name, weights] : files::parts(network)) add("weights", weights->path);
    } catch (const files::InputError&) {
      return;  // the checks report what is wrong with the file
    }
  }

  void add_model(const std::string& path) {
    add("model", path);
    try {
      for (const stability::EffectSpec& effect : stability::read_model(path).effects) {
        if (effect.network.empty()) continue;
        files::NetworkArguments arguments;
        arguments.file =
            (std::filesystem::path(path).parent_path() / effect.network).lexically_normal().string();
        add_network("network of a model", arguments);
      }
    } catch (const files::InputError&) {
      return;
    }
  }

  /// Adds the whole export to which `path` belongs, so that a bundle can be compared again.
  void add_source(const std::string& path) {
    if (path.empty()) return;
    std::error_code ignored;
    if (!std::filesystem::is_directory(path, ignored)) add("source", path);
    for (const std::string& file : firmware::files_of_export(path)) add("source", file);
  }

  std::vector<EvidenceFile> take() { return std::move(files_); }

 private:
  std::vector<EvidenceFile> files_;
};

}  // namespace

std::vector<EvidenceFile> evidence_files(const Policy& policy, const std::string& baseline) {
  const Release& release = policy.release;
  FileList list;
  list.add("policy", policy.path);
  if (release.has_network()) list.add_network("network", release.network);
  list.add("certificate", release.certificate);
  list.add("box", release.box);
  list.add("gains", release.gains);
  if (!release.model.empty()) list.add_model(release.model);
  list.add_source(release.source);
  list.add("elf", release.elf);
  list.add("facts", release.facts);
  list.add("swarm", release.swarm);
  list.add("promise", release.promise);
  list.add("columns", release.columns);
  if (!release.vehicles.empty()) {
    list.add("vehicles", release.vehicles);
    try {
      for (const auto& [vehicle, use] : residuals::read_fleet(release.vehicles)) list.add_model(use.model);
    } catch (const files::InputError&) {
      list.add("vehicles", release.vehicles);
    }
  }
  for (const std::string& path : release.flights) {
    try {
      for (const std::string& log : residuals::log_files(residuals::find_flights({path})))
        list.add("log", log);
    } catch (const files::InputError&) {
      list.add("log", path);
    }
  }
  if (!baseline.empty() && std::filesystem::exists(baseline)) list.add("baseline", baseline);
  return list.take();
}

}  // namespace swarmcert::gate
