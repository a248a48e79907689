/// @file Read-only view of an HDF5 file in memory. The HDF5 library reads it in a process of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nn/weights/hdf5_nodes.h"

namespace swarmcert::files {

/// Returns true if HDF5's signature is at offset 0, 512, 1024, 2048, ...
bool looks_like_hdf5(std::string_view bytes);

/// A group or a dataset.
class Hdf5Object {
 public:
  bool is_group() const;
  /// Returns the names in a group, in alphabetical order. @throws InputError if there are too many.
  std::vector<std::string> links() const;
  bool has(const std::string& link) const;
  /// Opens "name" or "group/name". @throws InputError if there is none, or if it lies in another file.
  Hdf5Object open(const std::string& link) const;
  /// Returns the text or texts of an attribute, or nothing if there is none.
  /// @throws InputError if it is not text.
  std::optional<std::vector<std::string>> texts(const std::string& attribute) const;
  /// Returns whether an attribute is there and holds a number other than 0.
  bool flag(const std::string& attribute) const;
  /// Returns the numbers of a dataset.
  /// @throws InputError unless they are float16, float32, float64 or integers of up to 32 bits, at most kMostElements.
  hdf5::Numbers numbers() const;
  /// Returns the objects to which a dataset of references refers.
  std::vector<Hdf5Object> references() const;

 private:
  friend Hdf5Object hdf5_root(const std::string& bytes, const std::string& path);
  struct File;
  Hdf5Object(std::shared_ptr<File> file, std::uint64_t number, std::string name);
  [[noreturn]] void refuse(const std::string& what) const;
  const hdf5::Node& node() const;

  std::shared_ptr<File> file_;
  std::uint64_t number_;
  std::string name_;
};

/// Returns the root group of an HDF5 file in memory.
/// @throws InputError if this is not an HDF5 file, or so damaged that the library cannot read it.
Hdf5Object hdf5_root(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::files
