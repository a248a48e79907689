/// @file Datasets and attributes of HDF5: arrays of numbers, of text and of references to other objects.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nn/weights/matlab/hdf5_file.h"

namespace swarmcert::files {

/// Little-endian, of at most 8 bytes, IEEE where it is float.
enum class Hdf5Class { kInteger, kFloat, kText, kReference };

struct Hdf5Type {
  Hdf5Class type_class = Hdf5Class::kInteger;
  std::size_t size_bytes = 0;  ///< of one element
  bool is_signed = false;      ///< of integers
};

struct Hdf5Array {
  std::vector<std::uint64_t> shape;  ///< of row-major elements; none: a single one
  Hdf5Type type;
  std::string bytes;       ///< of all elements
  std::size_t offset = 0;  ///< in the file, for messages
};

/// The array that a dataset holds: compact, contiguous, or chunked with deflate and shuffle.
/// @throws InputError for anything else, and where the file contradicts itself.
Hdf5Array array_of(Hdf5File& file, const Hdf5Object& dataset);

/// The attribute `name` of a group or dataset.
std::optional<Hdf5Array> attribute_of(Hdf5File& file, const Hdf5Object& object, const std::string& name);

/// What the elements of `array` are as doubles, exactly. `name` is for messages.
/// @throws InputError unless they are float32, float64, or integers of at most 32 bits.
std::vector<double> numbers_of(const Hdf5Array& array, const std::string& name, const std::string& path);

}  // namespace swarmcert::files
