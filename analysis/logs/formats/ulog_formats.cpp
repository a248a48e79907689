#include "analysis/logs/formats/ulog_formats.h"

#include <algorithm>
#include <charconv>
#include <set>

namespace swarmcert::logs {
namespace {

/// A record including its header is at most 65535 bytes long.
constexpr std::size_t kLargestRecord_bytes = 65535;
constexpr int kDeepestUlogNesting = 8;

}  // namespace

std::optional<Scalar> ulog_number(std::string_view type) {
  if (type == "bool") return Scalar::kUint8;
  const std::size_t end = type.rfind("_t");
  return end + 2 == type.size() || type == "float" || type == "double" ? scalar_called(type.substr(0, end))
                                                                       : std::nullopt;
}

std::optional<UlogFormats::Field> UlogFormats::parse_field(std::string_view text) {
  const std::size_t blank = text.find(' ');
  if (blank == std::string_view::npos) return std::nullopt;
  Field field;
  field.name = text.substr(blank + 1);
  std::string_view type = text.substr(0, blank);
  const std::size_t bracket = type.find('[');
  if (bracket != std::string_view::npos) {
    const char* const first = type.data() + bracket + 1;
    const char* const last = type.data() + type.size() - 1;
    if (first >= last || *last != ']') return std::nullopt;
    const auto [end, error] = std::from_chars(first, last, field.count);
    if (error != std::errc() || end != last || field.count > kLargestRecord_bytes) return std::nullopt;
    field.is_array = true;
    type = type.substr(0, bracket);
  }
  if (!is_identifier(field.name) || !is_identifier(type)) return std::nullopt;
  field.number = ulog_number(type);
  field.is_text = type == "char";
  if (!field.number && !field.is_text) field.nested = type;
  return field;
}

bool UlogFormats::add(std::string_view definition) {
  const std::size_t colon = definition.find(':');
  if (colon == std::string_view::npos || !is_identifier(definition.substr(0, colon))) return false;
  const std::string name(definition.substr(0, colon));
  const auto known = formats_.find(name);
  if (known != formats_.end()) return known->second.definition == definition;
  Format format;
  format.definition = definition;
  std::set<std::string> names;
  std::string_view rest = definition.substr(colon + 1);
  while (!rest.empty() && rest[0] != '\0') {
    const std::size_t end = std::min(rest.find(';'), rest.size());
    const std::optional<Field> field = parse_field(rest.substr(0, end));
    if (!field || !names.insert(field->name).second) return false;
    format.fields.push_back(*field);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  formats_.emplace(name, std::move(format));
  return true;
}

std::optional<std::size_t> UlogFormats::element_size(const Field& field, int depth) {
  if (field.number) return size_of(*field.number);
  if (field.is_text) return 1;
  return measure(field.nested, depth + 1);
}

std::optional<std::size_t> UlogFormats::measure(const std::string& name, int depth) {
  const auto found = formats_.find(name);
  if (found == formats_.end() || depth > kDeepestUlogNesting || found->second.is_being_measured)
    return std::nullopt;
  Format& format = found->second;
  if (format.is_measured) {
    if (depth + format.nesting > kDeepestUlogNesting) return std::nullopt;
    return format.size;
  }
  format.is_being_measured = true;
  // Resumes at the field whose definition was missing before, so that a file cannot force a restart with every record.
  for (; format.next < format.fields.size(); ++format.next) {
    Field& field = format.fields[format.next];
    const std::optional<std::size_t> element = element_size(field, depth);
    if (!element || format.size + *element * field.count > kLargestRecord_bytes) break;
    field.element_bytes = *element;
    format.size += *element * field.count;
    if (!field.nested.empty())
      format.nesting = std::max(format.nesting, 1 + formats_.at(field.nested).nesting);
  }
  format.is_being_measured = false;
  if (format.next < format.fields.size()) return std::nullopt;
  format.is_measured = true;
  // Zero-sized fields would take no space in the file however often they are repeated.
  const auto is_empty = [](const Field& field) { return field.element_bytes * field.count == 0; };
  format.fields.erase(std::remove_if(format.fields.begin(), format.fields.end(), is_empty),
                      format.fields.end());
  return format.size;
}

std::optional<UlogSize> UlogFormats::size(const std::string& name) {
  const std::optional<std::size_t> largest = measure(name, 0);
  if (!largest) return std::nullopt;
  std::size_t padding = 0;
  const std::vector<Field>& fields = formats_.at(name).fields;
  if (!fields.empty() && fields.back().is_padding())
    padding = fields.back().element_bytes * fields.back().count;
  return UlogSize{*largest - padding, *largest};
}

void UlogFormats::lay_out_element(const Field& field, const std::string& name, std::size_t offset,
                                  UlogLayout& layout) {
  if (!field.number) return lay_out(formats_.at(field.nested), name + ".", offset, layout);
  if (layout.numbers.size() < kMostColumns)
    layout.numbers.push_back({name, *field.number, offset});
  else
    layout.has_too_many_columns = true;
}

void UlogFormats::lay_out(const Format& format, const std::string& prefix, std::size_t offset,
                          UlogLayout& layout) {
  for (const Field& field : format.fields) {
    const std::size_t size = field.element_bytes * field.count;
    const std::string name = prefix + field.name;
    const bool is_time = prefix.empty() && name == "timestamp" && field.number && !field.is_array;
    if (is_time) {
      layout.timestamp = UlogNumber{name, *field.number, offset};
    } else if (field.is_text || field.is_padding()) {
      // No signal.
    } else if (field.count > kMostElements) {
      layout.large_arrays.push_back(name);
    } else if (!field.is_array) {
      lay_out_element(field, name, offset, layout);
    } else {
      for (std::size_t i = 0; i < field.count; ++i)
        lay_out_element(field, name + "[" + std::to_string(i) + "]", offset + i * field.element_bytes,
                        layout);
    }
    offset += size;
  }
}

UlogLayout UlogFormats::layout(const std::string& name) {
  UlogLayout layout;
  lay_out(formats_.at(name), "", 0, layout);
  return layout;
}

}  // namespace swarmcert::logs
