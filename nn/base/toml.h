/// @file Reading TOML strictly: every value has its type, every key its use, every error its line.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <vector>

namespace swarmcert::files {

/// Parses a TOML document. Letters beyond ASCII may stand in comments and in texts in double quotes.
/// @throws InputError with line and column if it is not TOML, is larger than 64 KiB or nests thousands of keys.
toml::table parse_toml(const std::string& text, const std::string& path);

/// One table of a document. All readers throw InputError with line, dotted key, value and what is expected.
class TomlTable {
 public:
  /// @param table must outlive this.
  TomlTable(const toml::table& table, std::string path) : table_(&table), path_(std::move(path)) {}

  /// @throws InputError at the first key that is not one of `known`, with a did-you-mean.
  void allow_only(const std::vector<std::string>& known) const;

  /// @throws InputError unless `schema`, which every file of ours begins with, is `schema`.
  void require_schema(const std::string& schema) const;

  /// Line of the value of `key`, or of the table itself where `key` is empty; 0 where there is none.
  int line(const std::string& key = "") const;
  bool has(const std::string& key) const { return table_->contains(key); }
  /// In alphabetical order: toml++ keeps no other.
  std::vector<std::string> keys() const;

  /// Each throws if `key` is missing or has another type. Numbers are finite; integers are taken as numbers.
  std::string text(const std::string& key) const;
  double number(const std::string& key) const;
  std::vector<double> numbers(const std::string& key) const;
  std::vector<std::string> texts(const std::string& key) const;
  /// A list of lists of numbers; the inner lists may have different lengths.
  std::vector<std::vector<double>> rows(const std::string& key) const;
  /// Whether `key` holds a list; whether one whose first element is a list. False where it is missing.
  bool is_list(const std::string& key) const;
  bool is_list_of_lists(const std::string& key) const;
  TomlTable table(const std::string& key) const;
  /// A list of tables, [[key]]; in messages the second is `key[2]`.
  std::vector<TomlTable> tables(const std::string& key) const;
  bool flag(const std::string& key) const;

  /// A text that is one of `allowed`; its index in that list.
  std::size_t choice(const std::string& key, const std::vector<std::string>& allowed) const;

  /// Throws InputError about the value of `key`, or about the table itself where `key` is empty.
  [[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& what,
                           const std::string& hint = "") const;

 private:
  TomlTable(const toml::table& table, std::string path, std::string prefix)
      : table_(&table), path_(std::move(path)), prefix_(std::move(prefix)) {}
  const toml::node& node(const std::string& key) const;

  const toml::table* table_;
  std::string path_;
  std::string prefix_;  ///< "gamma." in the table `gamma`, empty at the top
};

}  // namespace swarmcert::files
