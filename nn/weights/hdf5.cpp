#include "nn/weights/hdf5.h"

#include <algorithm>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/hdf5_library.h"
#include "nn/weights/own_process.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {

struct Hdf5Object::File {
  std::string path;
  std::vector<hdf5::Node> nodes;
  std::uint64_t numbers = 0;  ///< taken so far, from one dataset as often as it was taken
};

bool looks_like_hdf5(std::string_view bytes) {
  constexpr std::string_view kSignature("\x89HDF\r\n\x1a\n", 8);
  for (std::size_t at = 0; at < bytes.size(); at = std::max<std::size_t>(512, 2 * at))
    if (bytes.compare(at, kSignature.size(), kSignature) == 0) return true;
  return false;
}

Hdf5Object::Hdf5Object(std::shared_ptr<File> file, std::uint64_t number, std::string name)
    : file_(std::move(file)), number_(number), name_(std::move(name)) {}

void Hdf5Object::refuse(const std::string& what) const {
  throw InputError({file_->path, "", in_quotes(name_), "", what,
                    "save the numbers as float32 or float64 in plain datasets of one file"});
}

const hdf5::Node& Hdf5Object::node() const { return file_->nodes[number_]; }

bool Hdf5Object::is_group() const { return node().is_group; }

std::vector<std::string> Hdf5Object::links() const {
  if (!node().problem.empty()) refuse(node().problem);
  std::vector<std::string> names;
  for (const auto& [name, target] : node().links) names.push_back(name);
  return names;
}

bool Hdf5Object::has(const std::string& link) const { return node().links.count(link) == 1; }

Hdf5Object Hdf5Object::open(const std::string& link) const {
  Hdf5Object at = *this;
  for (std::string rest = link; !rest.empty();) {
    const std::string step = rest.substr(0, rest.find('/'));
    rest.erase(0, std::min(step.size() + 1, rest.size()));
    const auto found = at.node().links.find(step);
    if (found == at.node().links.end()) refuse("has no " + in_quotes(link));
    if (found->second == hdf5::kElsewhere) refuse(in_quotes(link) + " lies in another file");
    at.number_ = found->second;
  }
  at.name_ += "/" + link;
  return at;
}

std::optional<std::vector<std::string>> Hdf5Object::texts(const std::string& attribute) const {
  const auto found = node().attributes.find(attribute);
  if (found == node().attributes.end()) return std::nullopt;
  const std::string its = "its attribute " + in_quotes(attribute) + " ";
  if (!found->second.is_text) refuse(its + "is not text");
  if (!found->second.problem.empty()) refuse(its + found->second.problem);
  return found->second.texts;
}

bool Hdf5Object::flag(const std::string& attribute) const {
  const auto found = node().attributes.find(attribute);
  if (found == node().attributes.end()) return false;
  if (!found->second.problem.empty())
    refuse("its attribute " + in_quotes(attribute) + " " + found->second.problem);
  return found->second.number != 0;
}

hdf5::Numbers Hdf5Object::numbers() const {
  if (!node().problem.empty()) refuse(node().problem);
  if (node().is_group || node().has_references) refuse("holds no numbers");
  file_->numbers += node().numbers.numbers.size();
  if (file_->numbers > kMostElements) refuse("and what was read before it have more than 2^25 numbers");
  return node().numbers;
}

std::vector<Hdf5Object> Hdf5Object::references() const {
  if (!node().problem.empty()) refuse(node().problem);
  if (!node().has_references) refuse("is a cell array without references");
  std::vector<Hdf5Object> objects;
  for (const std::uint64_t number : node().references) objects.push_back({file_, number, name_});
  return objects;
}

Hdf5Object hdf5_root(const std::string& bytes, const std::string& path) {
  auto file = std::make_shared<Hdf5Object::File>();
  file->path = path;
  in_own_process([&](std::FILE* to) { hdf5::write_nodes(bytes, to); },
                 [&](std::FILE* from) { file->nodes = hdf5::read_nodes(from); },
                 4 * sizeof(double) * kMostElements + 2 * bytes.size());
  if (file->nodes.empty()) throw InputError({path, "", "", "", "is not a complete HDF5 file", kCopyAgain});
  return {std::move(file), 0, ""};
}

}  // namespace swarmcert::files
