/// @file What an HDF5 file holds, as plain data that one process writes and another reads.
#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

namespace swarmcert::files::hdf5 {

/// Maximum number of links of a group, elements of an attribute, and references of a dataset.
inline constexpr std::size_t kMostEntries = 4096;

/// Target of a link to another file.
inline constexpr std::uint64_t kElsewhere = ~std::uint64_t{0};

struct Numbers {
  std::vector<std::uint64_t> shape;
  std::vector<double> numbers;  ///< row-major, exact
  bool is_float32 = false;      ///< stored as float32 or float16
};

struct Attribute {
  std::string problem;  ///< why it cannot be read; empty: it can
  bool is_text = false;
  std::vector<std::string> texts;
  double number = 0;  ///< of a single number; 0 for others
};

/// A group or a dataset.
struct Node {
  std::string problem;  ///< why its names or numbers cannot be read; empty: they can
  bool is_group = false;
  std::map<std::string, std::uint64_t> links;  ///< to the number of a node, or kElsewhere
  std::map<std::string, Attribute> attributes;
  Numbers numbers;
  bool has_references = false;
  std::vector<std::uint64_t> references;  ///< numbers of nodes
};

/// Writes `nodes` in the order and sizes of this machine. Errors are those of the stream.
void write(const std::vector<Node>& nodes, std::FILE* file);

/// Reads what write() wrote. Returns an empty list if the file does not hold that, if it refers to nodes that it does
/// not hold, or if its numbers are more than kMostElements (tensors.h).
std::vector<Node> read_nodes(std::FILE* file);

}  // namespace swarmcert::files::hdf5
