#include "analysis/firmware/match_artefact.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "analysis/firmware/image_checks.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/weights/c_source.h"
#include "nn/weights/functions.h"

namespace swarmcert::firmware {
namespace {

std::string in_words(const Difference& d, const std::string& path) {
  if (!d.found) return fmt::format("nothing in {} resembles {} {} {}", path, d.part, d.layer, d.entry);
  return fmt::format("{} {} {} is {} in the network, {} in {} ({}, {})", d.part, d.layer, d.entry,
                     files::hex_float(static_cast<double>(d.expected)),
                     files::hex_float(static_cast<double>(*d.found)), path, d.name, d.place);
}

std::string in_words(const FileDifference& d) {
  return d.line == 0 ? fmt::format("{} {}", d.file, d.what)
                     : fmt::format("{}, line {}: {}", d.file, d.line, d.what);
}

void add_weights(const MatchResult& weights, const std::string& path, ArtefactMatch& result) {
  result.arrays = weights.arrays;
  result.numbers = weights.numbers;
  if (weights.equal() || result.first_difference) return;
  result.number_difference = weights.first_difference;
  result.first_difference = in_words(*weights.first_difference, path);
}

bool is_same(const files::Weights& a, const files::Weights& b) {
  const auto same_layer = [](const files::Layer& x, const files::Layer& y) {
    return x.outputs == y.outputs && x.inputs == y.inputs && x.weights == y.weights && x.biases == y.biases;
  };
  return std::equal(a.layers.begin(), a.layers.end(), b.layers.begin(), b.layers.end(), same_layer);
}

/// Returns why the source contains anything other than the network's weights; empty if it does not.
std::string why_not_pure(const files::Network& network, const std::string& bytes, const std::string& path) {
  try {
    std::map<std::string, files::Weights> found = files::parse_pure_c_source(bytes, path);
    for (const auto& [part, weights] : files::parts(network)) {
      const auto same = std::find_if(found.begin(), found.end(), [&weights = *weights](const auto& one) {
        return is_same(one.second, weights);
      });
      if (same == found.end()) return "no object holds " + part.name() + " alone";
      found.erase(same);
    }
    if (!found.empty()) return "it also holds '" + found.begin()->first + "', which is not in the network";
    return "";
  } catch (const files::InputError& error) {
    return error.what();
  }
}

void match_export_files(const files::Network& network, const std::string& path,
                        const ExportMatchOptions& options, ArtefactMatch& result) {
  const ExportMatch match = match_export(network, path, options);
  result.parameters = match.parameters;
  result.files = match.compared;
  result.compared.push_back(
      fmt::format("byte for byte with the regenerated export, CR LF at line ends read as LF: {}",
                  fmt::join(match.compared, ", ")));
  for (const std::string& file : match.absent) result.not_covered.push_back(file + ", which is not there");
  if (options.certificate_sha256 == std::nullopt && !match.parameters.certificate_sha256.empty())
    result.not_covered.push_back("whether the certificate " + match.parameters.certificate_sha256 +
                                 " that the files name exists and is accepted");
  if (!match.first_difference) return;
  result.file_difference = match.first_difference;
  result.first_difference = in_words(*match.first_difference);
}

/// Counts the weights in the source of the export, if it was compared, and reports the first that differs.
void add_weights_of_export(const files::Network& network, ArtefactMatch& result) {
  for (const std::string& file : result.files) {
    const std::string bytes = files::read_file(file);
    if (bytes.find("_layer {") == std::string::npos) continue;  // the headers contain no weights
    try {
      const MatchResult weights = match(network, blocks_in_source(bytes, file));
      result.arrays = weights.arrays;
      result.numbers = weights.numbers;
      if (weights.equal() || !result.first_difference) return;
      result.number_difference = weights.first_difference;
      result.first_difference = in_words(*weights.first_difference, file) + "; " + *result.first_difference;
    } catch (const files::InputError&) {
      return;  // the remaining text contains no arrays: the files differ, as reported already
    }
  }
}

void match_other_source(const files::Network& network, const std::string& path, const std::string& bytes,
                        ArtefactMatch& result) {
  result.files = {path};
  add_weights(match(network, blocks_in_source(bytes, path)), path, result);
  result.compared.push_back(fmt::format("{}: all {} weights and biases, in {} arrays, bit for bit", path,
                                        result.numbers, result.arrays));
  result.not_covered.emplace_back("the code that reads these weights");
  const std::string why = why_not_pure(network, bytes, path);
  if (!why.empty()) result.not_checked.push_back("that a compiler takes these weights and no others: " + why);
}

/// Keeps the blocks of the objects that hold the network's layers, if the image has all of them by name.
std::vector<FloatBlock> blocks_of(const std::vector<WeightsObject>& objects, std::vector<FloatBlock> blocks) {
  std::set<std::string> names;
  for (const WeightsObject& object : objects) {
    if (object.symbol == nullptr) return blocks;
    names.insert(object.name);
  }
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(),
                              [&names](const FloatBlock& block) { return names.count(block.name) == 0; }),
               blocks.end());
  return blocks;
}

void match_elf(const files::Network& network, const std::string& path, const std::string& bytes,
               const ArtefactOptions& options, ArtefactMatch& result) {
  result.files = {path};
  std::vector<FloatBlock> blocks = blocks_in_elf(bytes, path);
  const ElfImage image = read_arm_image(bytes);
  if (image.why_not.empty() && !network.plain) {
    const std::vector<WeightsObject> objects = weights_objects(network, image);
    blocks = blocks_of(objects, std::move(blocks));
    std::string twice = image.contradiction;
    if (twice.empty()) twice = duplicate_symbol(image);
    const bool has_names = std::all_of(objects.begin(), objects.end(),
                                       [](const WeightsObject& object) { return object.symbol != nullptr; });
    if (twice.empty() && has_names) twice = second_copy(network, objects, image);
    if (!twice.empty()) result.first_difference = path + " has " + twice;
  }
  add_weights(match(network, blocks), path, result);
  result.compared.push_back(fmt::format("{}: all {} weights and biases, in {} arrays, bit for bit", path,
                                        result.numbers, result.arrays));
  if (result.first_difference) return;
  const CodeMatch code = match_code(network, image, options.most_neighbours, options.app);
  for (const std::string& what : code.compared) result.compared.push_back(path + ": " + what);
  result.not_covered = code.not_covered;
  if (options.needs_app && code.outcome == CodeMatch::Outcome::kSame && !code.holds_app)
    result.first_difference = path + " does not hold the app, so that nothing says what flies";
  if (code.outcome == CodeMatch::Outcome::kNotChecked)
    result.not_checked.push_back("the code in " + path + ": " + code.why_not);
  if (code.outcome == CodeMatch::Outcome::kDifferent) result.first_difference = path + ": " + code.difference;
}

}  // namespace

const char* name(ArtefactVerdict verdict) {
  switch (verdict) {
    case ArtefactVerdict::kEqual:
      return "equal";
    case ArtefactVerdict::kDifferent:
      return "different";
    case ArtefactVerdict::kInconclusive:
      break;
  }
  return "inconclusive";
}

ArtefactMatch match_artefact(const files::Network& network, const std::string& path,
                             const ArtefactOptions& options) {
  ArtefactMatch result;
  const bool is_folder = std::filesystem::is_directory(path);
  if (is_folder && !holds_export(path)) {
    throw files::InputError({path, "", "", "", "contains no file written by swarmcert export",
                             "name the folder of -o, or the file to compare"});
  }
  const std::string bytes = is_folder ? "" : files::read_file(path);
  if (is_folder || (!is_elf(bytes) && is_exported_file(path, bytes))) {
    match_export_files(network, path, options.source, result);
    add_weights_of_export(network, result);
  } else if (is_elf(bytes)) {
    match_elf(network, path, bytes, options, result);
  } else {
    match_other_source(network, path, bytes, result);
  }
  result.verdict = result.first_difference       ? ArtefactVerdict::kDifferent
                   : !result.not_checked.empty() ? ArtefactVerdict::kInconclusive
                                                 : ArtefactVerdict::kEqual;
  return result;
}

}  // namespace swarmcert::firmware
