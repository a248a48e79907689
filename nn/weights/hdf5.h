/// @file Read-only view of an HDF5 file in memory, by the HDF5 library.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::files {

/// Maximum number of links of a group, elements of an attribute, and references of a dataset.
inline constexpr std::size_t kMostHdf5Entries = 4096;

/// Returns true if HDF5's signature is at offset 0, 512, 1024, 2048, ...
bool looks_like_hdf5(std::string_view bytes);

struct Hdf5Numbers {
  std::vector<std::uint64_t> shape;
  std::vector<double> numbers;  ///< row-major, exact
  bool is_float32 = false;      ///< stored as float32 or float16
};

/// A group or a dataset. Keeps its file open.
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
  Hdf5Numbers numbers() const;
  /// Returns the objects to which a dataset of references refers.
  std::vector<Hdf5Object> references() const;

 private:
  friend class Hdf5File;
  struct State;
  explicit Hdf5Object(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;
};

/// Opens a file in memory. Only one may be open per thread and at a time: the library is not safe for threads.
class Hdf5File {
 public:
  /// @param bytes, path  must outlive the file and its objects.
  /// @throws InputError if this is not an HDF5 file.
  Hdf5File(const std::string& bytes, const std::string& path);
  Hdf5Object root() const { return root_; }

 private:
  static Hdf5Object opened(const std::string& bytes, const std::string& path);
  Hdf5Object root_;
};

}  // namespace swarmcert::files
