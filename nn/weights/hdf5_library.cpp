#include "nn/weights/hdf5_library.h"

#include <hdf5.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "nn/weights/hdf5_nodes.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files::hdf5 {
namespace {

constexpr std::size_t kMostObjects = 1 << 16;
constexpr std::size_t kMostText = std::size_t{1} << 24;
/// Deflate, the strongest of the usual filters, makes 1032 bytes of one at most.
constexpr std::uint64_t kMostExpansion = 1032;

/// Closes an identifier of the library.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle(hid_t id, Close close) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  hid_t id() const { return id_; }
  bool is_open() const { return id_ >= 0; }

 private:
  hid_t id_;
  Close close_;
};

/// Why something cannot be read; the rest of the file may be.
struct Problem : std::runtime_error {
  using std::runtime_error::runtime_error;
};

void demand(bool holds, const char* problem) {
  if (!holds) throw Problem(problem);
}

/// Returns whether a type is IEEE 754's binary16, 32 or 64, or an integer of 1, 2 or 4 bytes without unused bits. The
/// library's conversions trust the positions of bits that a file states, and write past their buffers for others.
bool is_plain(hid_t type) {
  const std::size_t size = H5Tget_size(type);
  const H5T_class_t type_class = H5Tget_class(type);
  if (type_class != H5T_INTEGER && type_class != H5T_FLOAT) return false;
  const H5T_order_t order = H5Tget_order(type);
  if ((order != H5T_ORDER_LE && order != H5T_ORDER_BE) || H5Tget_offset(type) != 0 ||
      H5Tget_precision(type) != 8 * size)
    return false;
  if (type_class == H5T_INTEGER) return size == 1 || size == 2 || size == 4;
  if (size != 2 && size != 4 && size != 8) return false;
  const std::size_t exponent = size == 2 ? 5 : size == 4 ? 8 : 11;
  const std::size_t mantissa = 8 * size - exponent - 1;
  std::size_t sign_at = 0, exponent_at = 0, exponent_bits = 0, mantissa_at = 0, mantissa_bits = 0;
  return H5Tget_fields(type, &sign_at, &exponent_at, &exponent_bits, &mantissa_at, &mantissa_bits) >= 0 &&
         sign_at == 8 * size - 1 && exponent_at == mantissa && exponent_bits == exponent &&
         mantissa_at == 0 && mantissa_bits == mantissa &&
         H5Tget_ebias(type) == (std::size_t{1} << (exponent - 1)) - 1 &&
         H5Tget_norm(type) == H5T_NORM_IMPLIED;
}

std::vector<std::string> texts_of(hid_t attribute, hid_t type, hid_t space) {
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  const std::size_t size = H5Tget_size(type);
  demand(0 <= count && count <= static_cast<hssize_t>(kMostEntries) && size <= kMostText, "is too long");
  const auto entries = static_cast<std::size_t>(count);
  std::vector<std::string> result;
  if (H5Tis_variable_str(type) > 0) {
    std::vector<char*> texts(entries, nullptr);
    demand(H5Aread(attribute, type, texts.data()) >= 0, "cannot be read");
    for (const char* text : texts) result.emplace_back(text == nullptr ? "" : text);
    return result;
  }
  demand(size * entries <= kMostText, "is too long");
  std::string bytes(size * entries, '\0');
  demand(H5Aread(attribute, type, bytes.data()) >= 0, "cannot be read");
  for (std::size_t k = 0; k < entries; ++k) {
    const std::string text = bytes.substr(k * size, size);
    result.push_back(text.substr(0, text.find('\0')));
  }
  return result;
}

Attribute attribute_of(hid_t stored) {
  Attribute result;
  const Handle type(H5Aget_type(stored), H5Tclose);
  const Handle space(H5Aget_space(stored), H5Sclose);
  try {
    demand(type.is_open() && space.is_open(), "cannot be read");
    result.is_text = H5Tget_class(type.id()) == H5T_STRING;
    if (result.is_text) {
      result.texts = texts_of(stored, type.id(), space.id());
    } else if (H5Sget_simple_extent_npoints(space.id()) == 1) {
      demand(is_plain(type.id()), "is not a number of a plain type");
      demand(H5Aread(stored, H5T_NATIVE_DOUBLE, &result.number) >= 0, "cannot be read");
    }
  } catch (const Problem& problem) {
    result.problem = problem.what();
  }
  return result;
}

/// Reads all that can be reached from the root, each object once.
class Walk {
 public:
  Walk(hid_t file, std::uint64_t bytes) : bytes_(bytes) {
    number_of(H5Gopen2(file, "/", H5P_DEFAULT));
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const Handle object(objects_[k], H5Oclose);
      try {
        read_attributes(object.id(), nodes_[k]);
        nodes_[k].is_group = H5Iget_type(object.id()) == H5I_GROUP;
        nodes_[k].is_group ? read_links(object.id(), k) : read_dataset(object.id(), k);
      } catch (const Problem& problem) {
        nodes_[k].problem = problem.what();
      }
    }
  }
  const std::vector<Node>& nodes() const { return nodes_; }

 private:
  /// Takes an open object. Its number is that of the node that holds it.
  std::uint64_t number_of(hid_t object) {
    H5O_info_t info;
    demand(object >= 0 && H5Oget_info2(object, &info, H5O_INFO_BASIC) >= 0, "refers to nothing");
    const auto [found, is_new] = numbers_.try_emplace(info.addr, nodes_.size());
    if (!is_new) {
      H5Oclose(object);
      return found->second;
    }
    demand(nodes_.size() < kMostObjects, "is one of too many objects");
    nodes_.emplace_back();
    objects_.push_back(object);
    return found->second;
  }

  static void read_attributes(hid_t object, Node& node) {
    H5O_info_t info;
    demand(H5Oget_info2(object, &info, H5O_INFO_NUM_ATTRS) >= 0 && info.num_attrs <= kMostEntries,
           "has attributes that cannot be read");
    for (hsize_t k = 0; k < info.num_attrs; ++k) {
      const Handle stored(
          H5Aopen_by_idx(object, ".", H5_INDEX_NAME, H5_ITER_INC, k, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
      const ssize_t length = stored.is_open() ? H5Aget_name(stored.id(), 0, nullptr) : -1;
      if (length < 0 || length > static_cast<ssize_t>(kMostEntries)) continue;
      std::string name(static_cast<std::size_t>(length) + 1, '\0');
      H5Aget_name(stored.id(), name.size(), name.data());
      name.pop_back();
      node.attributes[name] = attribute_of(stored.id());
    }
  }

  /// Names of which the object cannot be opened are left out.
  void read_links(hid_t group, std::size_t node) {
    H5G_info_t info;
    demand(H5Gget_info(group, &info) >= 0, "is not a group that can be read");
    demand(info.nlinks <= kMostEntries, "holds more than 4096 names");
    for (hsize_t k = 0; k < info.nlinks; ++k) {
      const auto name_of = [&](char* text, std::size_t size) {
        return H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, k, text, size, H5P_DEFAULT);
      };
      const ssize_t length = name_of(nullptr, 0);
      demand(0 <= length && length <= static_cast<ssize_t>(kMostEntries), "holds a name that cannot be read");
      std::string name(static_cast<std::size_t>(length) + 1, '\0');
      name_of(name.data(), name.size());
      name.pop_back();
      H5L_info_t link;
      if (H5Lget_info(group, name.c_str(), &link, H5P_DEFAULT) < 0) continue;
      if (link.type == H5L_TYPE_EXTERNAL) {
        nodes_[node].links[name] = kElsewhere;
      } else if (const hid_t object = H5Oopen(group, name.c_str(), H5P_DEFAULT); object >= 0) {
        const std::uint64_t number = number_of(object);
        nodes_[node].links[name] = number;
      }
    }
  }

  void read_dataset(hid_t object, std::size_t node) {
    demand(H5Iget_type(object) == H5I_DATASET, "is not a dataset");
    const Handle type(H5Dget_type(object), H5Tclose);
    demand(type.is_open(), "cannot be read");
    nodes_[node].has_references = H5Tequal(type.id(), H5T_STD_REF_OBJ) > 0;
    if (nodes_[node].has_references)
      nodes_[node].references = references_of(object);
    else
      nodes_[node].numbers = numbers_of(object, type.id());
  }

  std::vector<std::uint64_t> references_of(hid_t object) {
    const Handle space(H5Dget_space(object), H5Sclose);
    const hssize_t count = H5Sget_simple_extent_npoints(space.id());
    demand(0 <= count && count <= static_cast<hssize_t>(kMostEntries), "has more than 4096 cells");
    std::vector<hobj_ref_t> stored(static_cast<std::size_t>(count));
    demand(count == 0 || H5Dread(object, H5T_STD_REF_OBJ, H5S_ALL, H5S_ALL, H5P_DEFAULT, stored.data()) >= 0,
           "cannot be read");
    std::vector<std::uint64_t> numbers;
    for (const hobj_ref_t& reference : stored)
      numbers.push_back(number_of(H5Rdereference2(object, H5P_DEFAULT, H5R_OBJECT, &reference)));
    return numbers;
  }

  Numbers numbers_of(hid_t object, hid_t type) {
    const Handle space(H5Dget_space(object), H5Sclose);
    const Handle layout(H5Dget_create_plist(object), H5Pclose);
    demand(is_plain(type), "holds numbers of another type");
    const int rank = H5Sget_simple_extent_ndims(space.id());
    demand(0 <= rank && rank <= 8, "has more than 8 dimensions");
    std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
    if (rank > 0) H5Sget_simple_extent_dims(space.id(), sizes.data(), nullptr);
    const auto count = element_count({sizes.begin(), sizes.end()});
    demand(count.has_value(), "has more than 2^25 numbers");
    demand(*count * H5Tget_size(type) <= kMostExpansion * bytes_, "has more numbers than its file can hold");
    demand(H5Pget_external_count(layout.id()) <= 0, "lies in another file");
    read_ += *count;
    demand(read_ <= kMostElements, "and what was read before it have more than 2^25 numbers");
    Numbers result;
    result.shape.assign(sizes.begin(), sizes.end());
    result.is_float32 = H5Tget_class(type) == H5T_FLOAT && H5Tget_size(type) <= 4;
    result.numbers.resize(*count);
    demand(*count == 0 ||
               H5Dread(object, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, result.numbers.data()) >= 0,
           "cannot be read: the file is damaged, or compressed by a filter that is not known");
    return result;
  }

  std::uint64_t bytes_, read_ = 0;
  std::map<haddr_t, std::uint64_t> numbers_;
  std::vector<Node> nodes_;
  std::vector<hid_t> objects_;  ///< by number; those that are still to be read are open
};

}  // namespace

void write_nodes(const std::string& bytes, std::FILE* file) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are problems of nodes
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access.id(), 1 << 16, 0);
  // The library copies the image.
  H5Pset_file_image(access.id(), const_cast<char*>(bytes.data()), bytes.size());
  const Handle opened(H5Fopen("in memory", H5F_ACC_RDONLY, access.id()), H5Fclose);
  demand(opened.is_open(), "is not a complete HDF5 file");
  write(Walk(opened.id(), bytes.size()).nodes(), file);
}

}  // namespace swarmcert::files::hdf5
