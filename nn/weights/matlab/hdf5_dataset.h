/// @file HDF5 datasets and attributes: arrays of numbers, text and references to other objects.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nn/weights/matlab/hdf5_file.h"

namespace swarmcert::files {

/// Little-endian, at most 8 bytes; floating-point types are IEEE.
enum class Hdf5Class { kInteger, kFloat, kText, kReference };

struct Hdf5Type {
  Hdf5Class type_class = Hdf5Class::kInteger;
  std::size_t size_bytes = 0;  ///< of one element
  bool is_signed = false;      ///< for integers
};

struct Hdf5Array {
  std::vector<std::uint64_t> shape;  ///< of the row-major elements; empty: a single element
  Hdf5Type type;
  std::string bytes;       ///< of all elements
  std::size_t offset = 0;  ///< in the file, for messages
};

/// Reads the array of a dataset: compact, contiguous, or chunked with deflate and shuffle.
/// @throws InputError for anything else, and if the file is inconsistent.
Hdf5Array array_of(Hdf5File& file, const Hdf5Object& dataset);

/// Reads the attribute `name` of a group or dataset; returns nothing if there is none.
std::optional<Hdf5Array> attribute_of(Hdf5File& file, const Hdf5Object& object, const std::string& name);

/// Returns the elements of `array` as doubles, exactly. `name` is used in messages only.
/// @throws InputError unless they are float32, float64, or integers of at most 32 bits.
std::vector<double> numbers_of(const Hdf5Array& array, const std::string& name, const std::string& path);

}  // namespace swarmcert::files
