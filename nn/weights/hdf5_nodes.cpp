#include "nn/weights/hdf5_nodes.h"

#include <type_traits>

#include "nn/weights/tensors.h"

namespace swarmcert::files::hdf5 {
namespace {

/// Writes, or reads, every member in the same order: `Stream` is one of the two below.
template <class Stream, class Value>
void transfer(Stream& stream, Value& value, const Attribute*) {
  stream.all(value.problem, value.is_text, value.texts, value.number);
}
template <class Stream, class Value>
void transfer(Stream& stream, Value& value, const Node*) {
  stream.all(value.problem, value.is_group, value.links, value.attributes, value.numbers.shape,
             value.numbers.numbers, value.numbers.is_float32, value.has_references, value.references);
}

class NodeWriter {
 public:
  explicit NodeWriter(std::FILE* file) : file_(file) {}
  template <class... Values>
  void all(const Values&... values) {
    ((*this)(values), ...);
  }
  template <class Value>
  void operator()(const Value& value) {
    if constexpr (std::is_arithmetic_v<Value>)
      std::fwrite(&value, sizeof value, 1, file_);
    else
      transfer(*this, value, &value);
  }
  void operator()(const std::string& text) { array(text); }
  template <class Value>
  void operator()(const std::vector<Value>& list) {
    if constexpr (std::is_arithmetic_v<Value>) return array(list);
    (*this)(std::uint64_t{list.size()});
    for (const Value& value : list) (*this)(value);
  }
  template <class Value>
  void operator()(const std::map<std::string, Value>& map) {
    (*this)(std::uint64_t{map.size()});
    for (const auto& [name, value] : map) {
      (*this)(name);
      (*this)(value);
    }
  }

 private:
  template <class Array>
  void array(const Array& array) {
    (*this)(std::uint64_t{array.size()});
    std::fwrite(array.data(), sizeof array[0], array.size(), file_);
  }
  std::FILE* file_;
};

class NodeReader {
 public:
  explicit NodeReader(std::FILE* file) : file_(file) {}
  bool is_good() const { return is_good_; }
  template <class... Values>
  void all(Values&... values) {
    ((*this)(values), ...);
  }
  template <class Value>
  void operator()(Value& value) {
    if constexpr (std::is_same_v<Value, bool>) {
      unsigned char byte = 0;
      (*this)(byte);
      value = byte != 0;
    } else if constexpr (std::is_arithmetic_v<Value>)
      is_good_ = is_good_ && std::fread(&value, sizeof value, 1, file_) == 1;
    else
      transfer(*this, value, &value);
  }
  void operator()(std::string& text) { array(text); }
  template <class Value>
  void operator()(std::vector<Value>& list) {
    if constexpr (std::is_arithmetic_v<Value>) return array(list);
    for (std::uint64_t left = size(); left > 0 && is_good_; --left) (*this)(list.emplace_back());
  }
  template <class Value>
  void operator()(std::map<std::string, Value>& map) {
    for (std::uint64_t left = size(); left > 0 && is_good_; --left) {
      std::string name;
      (*this)(name);
      (*this)(map[name]);
    }
  }

 private:
  std::uint64_t size() {
    std::uint64_t size = 0;
    (*this)(size);
    return size;
  }
  template <class Array>
  void array(Array& array) {
    const std::uint64_t count = size();
    is_good_ = is_good_ && count <= kMostElements;
    if (!is_good_) return;
    array.resize(count);
    is_good_ = std::fread(array.data(), sizeof array[0], count, file_) == count;
  }
  std::FILE* file_;
  bool is_good_ = true;
};

bool refers_within(const std::vector<Node>& nodes) {
  for (const Node& node : nodes) {
    for (const auto& [name, target] : node.links)
      if (target != kElsewhere && target >= nodes.size()) return false;
    for (const std::uint64_t target : node.references)
      if (target >= nodes.size()) return false;
  }
  return true;
}

}  // namespace

void write(const std::vector<Node>& nodes, std::FILE* file) { NodeWriter{file}(nodes); }

std::vector<Node> read_nodes(std::FILE* file) {
  std::vector<Node> nodes;
  NodeReader reader(file);
  reader(nodes);
  if (!reader.is_good() || !refers_within(nodes)) return {};
  return nodes;
}

}  // namespace swarmcert::files::hdf5
