#include "nn/weights/named_arrays.h"

#include <algorithm>
#include <cctype>
#include <optional>

#include "nn/base/input_error.h"
#include "nn/base/text.h"
#include "nn/weights/npy.h"
#include "nn/weights/tensors.h"
#include "nn/weights/zip_archive.h"

namespace swarmcert::files {
namespace {

constexpr char kNames[] =
    "name the arrays W1, b1, W2, b2, ... or fc1.weight, fc1.bias, ..., matrices as [outputs, inputs]";
constexpr std::size_t kMostArrays = 4096;

/// Returns "fc1.weight" for "fc1_weight", "layer1.bias" for "b1"; nothing if the name is not that of a weight or bias.
std::optional<std::string> tensor_name_of(const std::string& name) {
  struct Word {
    const char* word;
    const char* part;
  };
  static constexpr Word kWords[] = {{"weights", ".weight"}, {"weight", ".weight"}, {"W", ".weight"},
                                    {"w", ".weight"},       {"biases", ".bias"},   {"bias", ".bias"},
                                    {"B", ".bias"},         {"b", ".bias"}};
  std::size_t digits = name.size();
  while (digits > 0 && std::isdigit(static_cast<unsigned char>(name[digits - 1])) != 0) --digits;
  const std::string number = name.substr(digits);
  std::string stem = name.substr(0, digits);
  if (!number.empty()) {  // W1, weights_1
    if (ends_with(stem, "_")) stem.pop_back();
    for (const Word& word : kWords)
      if (stem == word.word) return "layer" + number + word.part;
  }
  for (const Word& word : kWords) {  // fc1.weight, fc1_weight
    for (const char* const mark : {".", "_", "/"}) {
      const std::string ending = std::string(mark) + word.word;
      if (ends_with(name, ending) && name.size() > ending.size())
        return name.substr(0, name.size() - ending.size()) + word.part;
    }
    if (name == word.word) return std::string(word.part).substr(1);
  }
  return std::nullopt;
}

/// Returns the number in NumPy's "arr_12".
std::optional<std::size_t> place_of(const std::string& name) {
  const std::string digits = name.rfind("arr_", 0) == 0 ? name.substr(4) : "";
  const bool is_number =
      !digits.empty() && digits.size() <= 4 &&
      std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!is_number) return std::nullopt;
  return static_cast<std::size_t>(std::stoul(digits));
}

bool is_vector(const NamedArray& array) {
  return array.shape.size() == 1 || (array.shape.size() == 2 && (array.shape[0] == 1 || array.shape[1] == 1));
}

/// Names arr_0, arr_1, ...: each matrix begins a layer, and biases whose length is its number of outputs complete it.
std::vector<std::string> names_by_place(const std::vector<const NamedArray*>& arrays) {
  std::vector<std::string> names;
  std::size_t layer = 0;
  std::uint64_t outputs = 0;  // outputs of the layer that has no biases yet; 0: no such layer
  for (const NamedArray* array : arrays) {
    const bool are_biases = outputs > 0 && is_vector(*array) && array->numbers.size() == outputs;
    if (!are_biases) ++layer;
    names.push_back("layer" + std::to_string(layer) + (are_biases ? ".bias" : ".weight"));
    outputs = are_biases || array->shape.empty() ? 0 : array->shape[0];
  }
  return names;
}

}  // namespace

Weights network_of_arrays(const std::vector<NamedArray>& arrays, const std::string& path,
                          const LayerChoice& choice) {
  const auto refuse = [&path](const std::string& name, const std::string& what, const std::string& hint) {
    throw InputError({path, "", in_quotes(name), "", what, hint});
  };
  std::vector<const NamedArray*> listed;
  for (const NamedArray& array : arrays) listed.push_back(&array);
  const bool are_placed =
      !arrays.empty() && std::all_of(arrays.begin(), arrays.end(),
                                     [](const NamedArray& a) { return place_of(a.name).has_value(); });
  std::vector<std::string> names;
  if (are_placed) {
    std::sort(listed.begin(), listed.end(), [](const NamedArray* a, const NamedArray* b) {
      return *place_of(a->name) < *place_of(b->name);
    });
    names = names_by_place(listed);
  } else {
    for (const NamedArray& array : arrays) {
      const std::optional<std::string> name = tensor_name_of(array.name);
      if (!name) refuse(array.name, "is neither the weights nor the biases of a layer", kNames);
      names.push_back(*name);
    }
  }
  bool is_float32 = true;
  for (const NamedArray& array : arrays) is_float32 = is_float32 && array.is_float32;
  std::vector<DeclaredTensor> tensors;
  for (std::size_t i = 0; i < listed.size(); ++i) {
    DeclaredTensor tensor{names[i], is_float32 ? Precision::kFloat32 : Precision::kFloat64, "",
                          listed[i]->shape};
    const bool is_bias = ends_with(names[i], "bias");
    if (is_bias && is_vector(*listed[i])) tensor.shape = {listed[i]->numbers.size()};
    tensors.push_back(std::move(tensor));
  }
  const TensorReader read = [&listed](std::size_t i) { return listed[i]->numbers; };
  return assemble(tensors, read, path, Listing::kUnordered, choice);
}

bool looks_like_npz(const std::string& bytes) {
  // In a zip header the first entry's name begins at offset 30 and its length is at offset 26.
  if (bytes.size() < 30 || bytes.compare(0, 4, "PK\3\4") != 0) return false;
  const std::size_t length = static_cast<unsigned char>(bytes[26]) |
                             static_cast<std::size_t>(static_cast<unsigned char>(bytes[27])) << 8;
  return length >= 4 && bytes.size() >= 30 + length && bytes.compare(26 + length, 4, ".npy") == 0;
}

Weights parse_npz(const std::string& bytes, const std::string& path, const LayerChoice& choice) {
  const ZipArchive archive(bytes, path);
  std::vector<NamedArray> arrays;
  std::uint64_t room_bytes = kMostElements * 8;
  if (archive.names().size() > kMostArrays)
    throw InputError({path, "", "", "", "holds more than " + std::to_string(kMostArrays) + " arrays", ""});
  for (const std::string& entry : archive.names()) {
    if (!ends_with(entry, ".npy"))
      throw InputError({path, "", in_quotes(entry), "", "is not a .npy array", "save with numpy.savez"});
    const std::string contents = archive.read(entry, room_bytes);
    room_bytes -= contents.size();
    NpyArray array = parse_npy(contents, path, entry);
    arrays.push_back({entry.substr(0, entry.size() - 4), std::move(array.shape), std::move(array.numbers),
                      array.is_float32});
  }
  return network_of_arrays(arrays, path, choice);
}

}  // namespace swarmcert::files
