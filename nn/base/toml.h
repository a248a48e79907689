/// @file Strict reading of TOML: every value must have the right type, every key must be known, every error has a line.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <vector>

namespace swarmcert::files {

/// Parses a TOML document. Non-ASCII characters are allowed in comments and in double-quoted strings.
/// @throws InputError with line and column if it is not TOML, is larger than 64 KiB or nests thousands of keys.
toml::table parse_toml(const std::string& text, const std::string& path);

/// One table of a document. All accessors throw InputError with line, dotted key, value and what is expected.
class TomlTable {
 public:
  /// @param table must outlive this.
  TomlTable(const toml::table& table, std::string path) : table_(&table), path_(std::move(path)) {}

  /// @throws InputError at the first key that is not one of `known`, with a spelling suggestion.
  void allow_only(const std::vector<std::string>& known) const;

  /// @throws InputError unless the key `schema`, with which each of our files begins, has the value `schema`.
  void require_schema(const std::string& schema) const;

  /// Returns the line of the value of `key`, or of the table itself if `key` is empty; 0 if there is none.
  int line(const std::string& key = "") const;
  bool has(const std::string& key) const { return table_->contains(key); }
  /// Returns the keys in alphabetical order; toml++ does not keep any other.
  std::vector<std::string> keys() const;

  /// These throw if `key` is missing or has another type. Numbers must be finite; integers are accepted as numbers.
  std::string text(const std::string& key) const;
  double number(const std::string& key) const;
  std::vector<double> numbers(const std::string& key) const;
  std::vector<std::string> texts(const std::string& key) const;
  /// Returns a list of lists of numbers; the inner lists may differ in length.
  std::vector<std::vector<double>> rows(const std::string& key) const;
  /// Return whether `key` holds a list, or a list whose first element is a list; false if the key is missing.
  bool is_list(const std::string& key) const;
  bool is_list_of_lists(const std::string& key) const;
  TomlTable table(const std::string& key) const;
  /// Returns a list of tables, [[key]]; messages call the second one `key[2]`.
  std::vector<TomlTable> tables(const std::string& key) const;
  bool flag(const std::string& key) const;

  /// Returns the index in `allowed` of the string value of `key`, which must be one of `allowed`.
  std::size_t choice(const std::string& key, const std::vector<std::string>& allowed) const;

  /// Throws InputError about the value of `key`, or about the table itself if `key` is empty.
  [[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& what,
                           const std::string& hint = "") const;

 private:
  TomlTable(const toml::table& table, std::string path, std::string prefix)
      : table_(&table), path_(std::move(path)), prefix_(std::move(prefix)) {}
  const toml::node& node(const std::string& key) const;

  const toml::table* table_;
  std::string path_;
  std::string prefix_;  ///< "gamma." in the table `gamma`, empty at the top level
};

}  // namespace swarmcert::files
