#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>

#include "nn/base/csv.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"
#include "nn/weights/npy.h"
#include "nn/weights/pth.h"
#include "nn/weights/samples.h"
#include "nn/weights/tensors.h"
#include "nn/weights/zip_archive.h"

namespace swarmcert::files {
namespace {

constexpr char kHowToRecord[] = "per sample, record every input and every output of the network";

[[noreturn]] void refuse_too_many(const std::string& path) {
  throw InputError({path, "", "", "", "has more than " + std::to_string(kMostElements) + " numbers",
                    "a few thousand samples are enough"});
}

void require_finite(double value, const std::string& path, const std::string& where,
                    const std::string& field) {
  if (std::isfinite(value)) return;
  throw InputError({path, where, field,
                    std::isnan(value) ? "nan"
                    : value > 0       ? "inf"
                                      : "-inf",
                    "not finite", "leave the sample out, or record it again"});
}

std::string field_of(std::size_t column, int inputs) {
  const auto split = static_cast<std::size_t>(inputs);
  return column < split ? "input " + std::to_string(column) : "output " + std::to_string(column - split);
}

// --- CSV

class CsvSamples {
 public:
  CsvSamples(std::string_view text, Samples& samples) : rest_(text), samples_(samples) {}

  void run() {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (rest_.substr(0, kByteOrderMark.size()) == kByteOrderMark) rest_.remove_prefix(kByteOrderMark.size());
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      ++line_;
      read(without_blanks(rest_.substr(0, end)));
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& what,
                           const std::string& hint) const {
    throw InputError({samples_.path, "line " + std::to_string(line_), field, value, what, hint});
  }

  void read(std::string_view line) {
    if (line.empty() || line.front() == '#') return;
    if (separator_ == '\0') separator_ = csv_separator(line, ' ');
    const std::vector<std::string_view> cells = csv_cells(line, separator_);
    const auto inputs = static_cast<std::size_t>(samples_.inputs);
    const std::size_t columns = inputs + static_cast<std::size_t>(samples_.outputs);
    if (cells.size() != columns)
      refuse("", std::to_string(cells.size()) + " columns",
             "the network has " + std::to_string(samples_.inputs) + " inputs and " +
                 std::to_string(samples_.outputs) + " outputs, which makes " + std::to_string(columns),
             kHowToRecord);
    double value = 0;
    const bool is_first = !has_lines_;
    has_lines_ = true;
    if (is_first && std::none_of(cells.begin(), cells.end(),
                                 [&value](std::string_view cell) { return csv_number(cell, value); }))
      return;  // column names
    if (samples_.x.size() + samples_.y.size() + columns > kMostElements) refuse_too_many(samples_.path);
    for (std::size_t k = 0; k < columns; ++k) {
      const std::string field = field_of(k, samples_.inputs);
      if (!csv_number(cells[k], value)) refuse(field, in_quotes(cells[k]), "is not a number", kHowToRecord);
      require_finite(value, samples_.path, "line " + std::to_string(line_), field);
      (k < inputs ? samples_.x : samples_.y).push_back(value);
    }
    samples_.lines.push_back(line_);
  }

  std::string_view rest_;
  Samples& samples_;
  int line_ = 0;
  char separator_ = '\0';
  bool has_lines_ = false;
};

// --- NumPy

/// Reads the array `name`, which must have `columns` columns; a single column may be one-dimensional.
std::vector<double> array_of(const ZipArchive& archive, const std::string& name, int columns,
                             const std::string& path) {
  const std::string entry = name + ".npy";
  if (!archive.has(entry)) {
    std::string list;
    for (std::size_t i = 0; i < archive.names().size() && i < 10; ++i)
      list += (i == 0 ? "" : ", ") + in_quotes(archive.names()[i]);
    throw InputError({path, "", in_quotes(name), "", "the archive has no such array, but " + list,
                      "numpy.savez(file, inputs=x, outputs=y)"});
  }
  NpyArray array = parse_npy(archive.read(entry, (kMostElements + 65'536) * 8), path, entry);
  const bool is_list = array.shape.size() == 1 && columns == 1;
  const bool is_matrix = array.shape.size() == 2 && array.shape[1] == static_cast<std::uint64_t>(columns);
  if (!is_list && !is_matrix)
    throw InputError({path, "", entry, shape_text(array.shape),
                      "must have the shape [samples, " + std::to_string(columns) + "]", kHowToRecord});
  const auto row = static_cast<std::size_t>(columns);
  for (std::size_t i = 0; i < array.numbers.size(); ++i)
    require_finite(array.numbers[i], path, "sample " + std::to_string(i / row),
                   entry + "[" + std::to_string(i / row) + "," + std::to_string(i % row) + "]");
  return std::move(array.numbers);
}

// --- JSON

std::vector<double> list_of(const Json& document, const std::string& name, int columns,
                            const std::string& path) {
  if (!document.contains(name) || !document[name].is_array())
    throw InputError({path, "", name, "", "is not a list of samples", kHowToRecord});
  std::vector<double> numbers;
  std::size_t sample = 0;
  for (const Json& row : document[name]) {
    const std::string where = "sample " + std::to_string(sample++);
    const bool is_bare = row.is_number() && columns == 1;
    const Json values = is_bare ? Json::array({row}) : row;
    if (!values.is_array() || values.size() != static_cast<std::size_t>(columns))
      throw InputError({path, where, name,
                        values.is_array() ? std::to_string(values.size()) + " numbers" : values.type_name(),
                        "must be " + std::to_string(columns) + " numbers", kHowToRecord});
    if (numbers.size() + values.size() > kMostElements) refuse_too_many(path);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const std::string field = name + "[" + std::to_string(k) + "]";
      if (!values[k].is_number())
        throw InputError({path, where, field, values[k].type_name(), "is not a number", kHowToRecord});
      require_finite(values[k].get<double>(), path, where, field);
      numbers.push_back(values[k].get<double>());
    }
  }
  return numbers;
}

bool looks_like_json(const std::string& bytes) {
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string::npos && bytes[first] == '{';
}

Json parse_samples_json(const std::string& bytes, const std::string& path) {
  Json document = parse_json(bytes, path);
  if (document.contains("schema") && document["schema"] != kSamplesSchema)
    throw InputError({path, "", "schema",
                      document["schema"].is_string() ? in_quotes(document["schema"].get<std::string>()) : "",
                      "must be " + in_quotes(kSamplesSchema), "is this the right file?"});
  return document;
}

void allow_only_keys(const Json& object, const std::vector<std::string>& keys, const std::string& path,
                     const std::string& where) {
  for (const auto& item : object.items()) {
    if (std::find(keys.begin(), keys.end(), item.key()) == keys.end())
      throw InputError(
          {path, where, in_quotes(item.key()), "", "is not a known key", "inputs and outputs are"});
  }
}

void read_lists(const Json& document, Samples& samples) {
  samples.x = list_of(document, "inputs", samples.inputs, samples.path);
  samples.y = list_of(document, "outputs", samples.outputs, samples.path);
}

void check_count(const Samples& samples) {
  const std::size_t outputs = samples.y.size() / static_cast<std::size_t>(samples.outputs);
  if (samples.count() != outputs)
    throw InputError({samples.path, "", "outputs", std::to_string(outputs) + " samples",
                      "but there are " + std::to_string(samples.count()) + " samples of the inputs",
                      kHowToRecord});
  if (samples.count() == 0) throw InputError({samples.path, "", "", "", "holds no sample", kHowToRecord});
}

Samples samples_of(const Network& network, const std::string& part, const std::string& bytes,
                   const std::string& path) {
  const Parts all = parts(network);
  const std::optional<FunctionId> named = FunctionId::parse(part);
  const auto found = named ? all.find(*named) : all.end();
  if (found == all.end()) {
    std::string list;
    for (const auto& [known, weights] : all) list += (list.empty() ? "" : ", ") + known.name();
    throw InputError(
        {path, "", in_quotes(part), "", "is not a part of this network", "its parts are: " + list});
  }
  Samples samples;
  samples.path = path;
  samples.sha256 = sha256(bytes);
  samples.inputs = found->second->inputs();
  samples.outputs = found->second->outputs();
  return samples;
}

/// Returns "PART" for "PART=FILE"; empty if `argument` is the name of a file.
std::string part_of(const std::string& argument, const Network& network) {
  const std::size_t equals = argument.find('=');
  if (equals == std::string::npos || std::filesystem::exists(argument)) return "";
  std::string part = argument.substr(0, equals);
  const std::optional<FunctionId> of_two_files = FunctionId::parse(part + ":default");  // --phi and --rho
  if (of_two_files && parts(network).count(*of_two_files) == 1) part = of_two_files->name();
  return part;
}

}  // namespace

Samples parse_samples(const std::string& bytes, const std::string& path, int inputs, int outputs) {
  Samples samples;
  samples.path = path;
  samples.sha256 = sha256(bytes);
  samples.inputs = inputs;
  samples.outputs = outputs;
  if (looks_like_pth_zip(bytes)) {
    const ZipArchive archive(bytes, path);
    samples.x = array_of(archive, "inputs", inputs, path);
    samples.y = array_of(archive, "outputs", outputs, path);
  } else if (looks_like_json(bytes)) {
    const Json document = parse_samples_json(bytes, path);
    allow_only_keys(document, {"schema", "inputs", "outputs"}, path, "");
    read_lists(document, samples);
  } else {
    CsvSamples(bytes, samples).run();
  }
  check_count(samples);
  return samples;
}

std::map<std::string, Samples> read_samples(const std::string& argument, const Network& network) {
  std::string part = part_of(argument, network);
  const std::string path = part.empty() ? argument : argument.substr(argument.find('=') + 1);
  const std::string bytes = read_file(path);
  std::map<std::string, Samples> result;
  const Json document = looks_like_json(bytes) ? parse_samples_json(bytes, path) : Json();
  if (document.contains("networks")) {
    allow_only_keys(document, {"schema", "networks"}, path, "");
    if (!document["networks"].is_object() || document["networks"].empty())
      throw InputError({path, "", "networks", "", "does not contain any part of a network", kHowToRecord});
    for (const auto& item : document["networks"].items()) {
      if (!part.empty() && part != item.key()) continue;
      Samples samples = samples_of(network, item.key(), bytes, path);
      if (!item.value().is_object())
        throw InputError({path, "", in_quotes(item.key()), "", "has no inputs and outputs", kHowToRecord});
      allow_only_keys(item.value(), {"inputs", "outputs"}, path, item.key());
      read_lists(item.value(), samples);
      check_count(samples);
      result.emplace(item.key(), std::move(samples));
    }
    if (result.empty())
      throw InputError({path, "", in_quotes(part), "", "the file has no samples of this part", ""});
    return result;
  }
  if (part.empty() && !network.plain)
    throw InputError({path, "", "", "", "does not state to which part of the network its samples belong",
                      "name it: --samples phi:KIND=FILE, rho:KIND=FILE"});
  if (part.empty()) part = "network";
  const Samples shape = samples_of(network, part, bytes, path);
  result.emplace(part, parse_samples(bytes, path, shape.inputs, shape.outputs));
  return result;
}

}  // namespace swarmcert::files
