#include "analysis/firmware/match_export.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "analysis/firmware/flight_headers.h"
#include "nn/base/file_io.h"
#include "nn/base/text.h"

namespace swarmcert::firmware {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> generated_names() {
  std::vector<std::string> names = {kExportedHeader, kExportedSource};
  for (const FlightHeader& header : kFlightHeaders) names.emplace_back(header.name);
  names.emplace_back(kExportedSamples);
  return names;
}

std::string normal(const std::string& path) { return fs::absolute(path).lexically_normal().string(); }

std::string with_line_feeds(const std::string& text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\r' || i + 1 == text.size() || text[i + 1] != '\n') result += text[i];
  }
  return result;
}

/// The line that contains the byte at `at`, shortened.
std::string line_at(const std::string& text, std::size_t at) {
  if (at >= text.size()) return "";
  const std::size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  std::string line = text.substr(first, std::min(text.find('\n', at), text.size()) - first).substr(0, 160);
  for (char& c : line) c = c < ' ' || c > '~' ? '?' : c;
  return line;
}

std::optional<FileDifference> difference_of(const std::string& file, const std::string& expected,
                                            const std::string& found) {
  const auto [mine, other] = std::mismatch(expected.begin(), expected.end(), found.begin(), found.end());
  if (mine == expected.end() && other == found.end()) return std::nullopt;
  const auto at = static_cast<std::size_t>(mine - expected.begin());
  FileDifference difference;
  difference.file = file;
  difference.line = 1 + static_cast<std::size_t>(std::count(expected.begin(), mine, '\n'));
  difference.expected = line_at(expected, at);
  difference.found = line_at(found, at);
  difference.what = at == found.size() ? "the file ends here, but the export continues"
                    : at == expected.size()
                        ? "the file continues after the end of the export"
                        : fmt::format("is '{}', exported is '{}'", difference.found, difference.expected);
  return difference;
}

/// The number or word after `name` in the line of parameters; empty if there is none.
std::string parameter(const std::string& text, const std::string& name) {
  const std::size_t line = text.find(kParameterLine);
  if (line == std::string::npos) return "";
  const std::size_t end = std::min(text.find_first_of("\r\n", line), text.size());
  const std::size_t at = text.find(" " + name + " ", line);
  if (at == std::string::npos || at >= end) return "";
  const std::size_t first = at + name.size() + 2;
  return text.substr(first, std::min(text.find_first_of(",\r\n", first), text.size()) - first);
}

template <typename Number>
void read_number(const std::string& word, Number least, Number most, Number& value) {
  Number read = 0;
  const char* const last = word.data() + word.size();
  const auto [end, error] = std::from_chars(word.data(), last, read);
  if (error == std::errc() && end == last && read >= least && read <= most) value = read;
}

/// The parameters stated by a file. Missing or malformed ones keep their default, which then shows as a difference.
ExportOptions stated_parameters(const std::string& text) {
  ExportOptions options;
  read_number(parameter(text, "most_neighbours"), 1, 64, options.most_neighbours);
  read_number<std::uint64_t>(parameter(text, "seed"), 0, ~std::uint64_t{0}, options.seed);
  const std::string hash = parameter(text, "certificate");
  if (hash.size() == 64 && hash.find_first_not_of("0123456789abcdef") == std::string::npos)
    options.certificate_sha256 = hash;
  return options;
}

/// Identifies which file of an export `path` is: by its name, otherwise by its first line.
std::string generated_name(const std::string& path, const std::string& bytes) {
  const std::string whole = normal(path);
  for (const std::string& name : generated_names()) {
    if (files::ends_with(whole, "/" + name)) return name;
  }
  const std::string first_line = bytes.substr(0, bytes.find('\n'));
  if (first_line.find(kGeneratedMark) == std::string::npos) return "";
  return first_line.find("@file") == std::string::npos ? kExportedSource : kExportedHeader;
}

std::string folder_of(const std::string& path, const std::string& name) {
  std::string folder = path.substr(0, path.size() - name.size());
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  return folder.empty() ? "." : folder;
}

std::optional<FileDifference> additional_file(const std::string& folder,
                                              const std::vector<std::string>& others) {
  std::vector<std::string> known;
  for (const std::string& name : generated_names()) known.push_back(normal(folder + "/" + name));
  for (const std::string& other : others) known.push_back(normal(other));
  std::vector<std::string> additional;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_directory() && !entry.is_symlink()) continue;
    if (std::find(known.begin(), known.end(), normal(entry.path().string())) == known.end())
      additional.push_back(entry.path().lexically_normal().string());
  }
  if (additional.empty()) return std::nullopt;
  const std::string& first = *std::min_element(additional.begin(), additional.end());
  return FileDifference{first, 0, "", "",
                        "is not a file of the export: a compiler may use it in place of a header"};
}

/// A file of an export that was read.
struct Read {
  std::string name, path, text;
};

/// Compares contents with those exported again, with the parameters that the first file states that states any; the
/// headers of the evaluator state none.
void compare_files(const files::Network& network, const std::vector<Read>& all, ExportMatch& result) {
  const auto states_any = [](const Read& read) {
    return read.text.find(kParameterLine) != std::string::npos;
  };
  const auto first = std::find_if(all.begin(), all.end(), states_any);
  if (first != all.end()) result.parameters = stated_parameters(first->text);
  const std::vector<SourceFile> expected = export_source(network, result.parameters);
  for (const Read& read : all) {
    result.compared.push_back(read.path);
    const auto same = [&read](const SourceFile& file) { return file.name == read.name; };
    const SourceFile& file = *std::find_if(expected.begin(), expected.end(), same);
    auto difference = difference_of(read.path, with_line_feeds(file.contents), read.text);
    if (!result.first_difference) result.first_difference = std::move(difference);
  }
}

}  // namespace

bool is_exported_file(const std::string& path, const std::string& bytes) {
  return !generated_name(path, bytes).empty();
}

bool holds_export(const std::string& folder) {
  for (const std::string& name : generated_names()) {
    if (fs::exists(fs::path(folder) / name)) return true;
  }
  return false;
}

std::vector<std::string> files_of_export(const std::string& path) {
  std::string folder = path;
  if (!fs::is_directory(path)) {
    const std::string name = generated_name(path, "");
    if (name.empty() || !files::ends_with(path, name)) return {};
    folder = folder_of(path, name);
  }
  std::vector<std::string> paths;
  for (const std::string& name : generated_names())
    paths.push_back((fs::path(folder) / name).lexically_normal().string());
  return paths;
}

ExportMatch match_export(const files::Network& network, const std::string& path,
                         const ExportMatchOptions& options) {
  ExportMatch result;
  std::vector<Read> read;
  const bool is_folder = fs::is_directory(path), needs_all = is_folder || options.needs_all;
  const auto note = [&result](const std::string& file, const std::string& what) {
    if (!result.first_difference) result.first_difference = FileDifference{file, 0, "", "", what};
  };
  const auto add = [&read](const std::string& name, const std::string& file, const std::string& bytes) {
    read.push_back({name, file, with_line_feeds(bytes)});
  };
  std::string named, folder = path;
  bool is_alone = false;  // a copy under another name: no related files next to it
  if (!is_folder) {
    const std::string bytes = files::read_file(path);
    named = generated_name(path, bytes);
    add(named, path, bytes);
    is_alone = !files::ends_with(path, named);
    folder = is_alone ? "" : folder_of(path, named);
    if (is_alone && needs_all) note(path, "does not have its name in the export, " + named);
  }
  for (const std::string& name : generated_names()) {
    if (name == named) continue;
    const std::string file = (fs::path(folder) / name).lexically_normal().string();
    if (!is_alone && fs::exists(file)) {
      add(name, file, files::read_file(file));
    } else {
      result.absent.push_back(file);
      if (needs_all) note(file, "is missing");
    }
  }
  if (needs_all && !is_alone && !result.first_difference)
    result.first_difference = additional_file(folder, options.other_contents);
  compare_files(network, read, result);
  const std::string& stated = result.parameters.certificate_sha256;
  if (const auto& certificate = options.certificate_sha256;
      certificate && !read.empty() && !stated.empty() && stated != *certificate)
    note(read.front().path, "was exported with the certificate " + stated + ", not with " + *certificate);
  return result;
}

}  // namespace swarmcert::firmware
