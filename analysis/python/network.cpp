#include "analysis/python/network.h"

#include <filesystem>
#include <map>
#include <vector>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/safetensors.h"
#include "nn/weights/tensors.h"

namespace py = pybind11;

namespace swarmcert::python {
namespace {

using Parts = std::map<std::string, files::Weights>;

/// Returns the precision; files::assemble() rejects all other numpy types with a message that names the type.
std::optional<files::Precision> precision_of(const py::array& array) {
  if (py::isinstance<py::array_t<float>>(array)) return files::Precision::kFloat32;
  if (py::isinstance<py::array_t<double>>(array)) return files::Precision::kFloat64;
  if (array.dtype().kind() == 'f' && array.dtype().itemsize() == 2) return files::Precision::kFloat16;
  return std::nullopt;
}

std::vector<double> numbers_of(const py::array& array) {
  const auto doubles = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(array);
  return {doubles.data(), doubles.data() + doubles.size()};
}

files::Weights weights_of(const std::string& name, const py::dict& part) {
  std::vector<files::DeclaredTensor> declared;
  std::vector<py::array> arrays;
  for (const py::handle item : part["tensors"]) {
    const auto pair = item.cast<std::pair<std::string, py::array>>();
    files::DeclaredTensor tensor;
    tensor.name = pair.first;
    tensor.precision = precision_of(pair.second);
    tensor.type = py::str(pair.second.dtype());
    for (py::ssize_t k = 0; k < pair.second.ndim(); ++k)
      tensor.shape.push_back(static_cast<std::uint64_t>(pair.second.shape(k)));
    declared.push_back(std::move(tensor));
    arrays.push_back(pair.second);
  }
  const bool is_chain = part["is_chain"].cast<bool>();
  files::Weights weights = files::assemble(
      declared, [&arrays](std::size_t i) { return numbers_of(arrays[i]); }, name,
      is_chain ? files::Listing::kEvaluation : files::Listing::kRegistration,
      part["order"].cast<std::vector<std::string>>());
  weights.sha256 = files::sha256(files::safetensors_bytes(weights));
  return weights;
}

/// Returns the name of the file that save_network() writes of a part without a description.
std::string file_of(const std::string& part) { return part + ".safetensors"; }

Parts parts_of(const py::dict& source) {
  Parts parts;
  for (const auto& [name, part] : source["parts"].cast<py::dict>()) {
    const auto key = name.cast<std::string>();
    parts.emplace(key, weights_of(key, py::reinterpret_borrow<py::dict>(part)));
  }
  return parts;
}

}  // namespace

files::Network network_of(const py::dict& source) {
  Parts parts = parts_of(source);
  const auto description = source["description"].cast<std::string>();
  if (!description.empty()) {
    return files::parse_network(
        description, "", [&parts](const std::string& path, const files::LayerChoice& choice) {
          const auto found = parts.find(path);
          if (found == parts.end())
            throw files::InputError({"", "", "weights", files::in_quotes(path),
                                     "is not among the given arrays", "give them under this name"});
          if (choice.is_stated())
            throw files::InputError({"", "", "order", "", "is part of the description of a network in memory",
                                     "give it as order="});
          return found->second;
        });
  }
  // A certificate names weight files, and is the same for arrays as for the files that hold them.
  for (auto& [name, weights] : parts) weights.path = file_of(name);
  files::Network network;
  if (parts.size() == 1) {
    network.plain = std::move(parts.begin()->second);
    return network;
  }
  network.phi.emplace("default", std::move(parts.at("phi")));
  network.rho.emplace("default", std::move(parts.at("rho")));
  const files::Weights &phi = network.phi.begin()->second, &rho = network.rho.begin()->second;
  if (phi.outputs() != rho.inputs())
    throw files::InputError({"rho", "", rho.layers.front().name + ".weight",
                             std::to_string(rho.inputs()) + " inputs",
                             "must be " + std::to_string(phi.outputs()) + ": phi has as many outputs",
                             "give a phi and a rho that were trained together"});
  return network;
}

std::string save_network(const py::dict& source, const std::string& folder, bool overwrite) {
  namespace fs = std::filesystem;
  files::require_relu(network_of(source),
                      "files are written of ReLU networks");  // also rejects networks that cannot be loaded
  const auto description = source["description"].cast<std::string>();
  std::string last;
  for (const auto& [name, weights] : parts_of(source)) {
    const fs::path path = fs::path(folder) / (description.empty() ? file_of(name) : name);
    files::save_safetensors(weights, path.string(), overwrite);
    last = path.string();
  }
  if (description.empty()) return last;
  const std::string path = (fs::path(folder) / "network.toml").string();
  files::write_file(path, description, overwrite);
  return path;
}

}  // namespace swarmcert::python
