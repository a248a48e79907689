#include "nn/weights/hdf5.h"

#include <hdf5.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace hdf5 {

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

/// Serializes all use of the library.
std::mutex& library() {
  static std::mutex mutex;
  return mutex;
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

struct OpenFile {
  OpenFile(const std::string& bytes, const std::string& file_path) : lock(library()), path(file_path) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are reported as InputError
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_fapl_core(access.id(), 1 << 16, 0);
    // The library copies the image.
    H5Pset_file_image(access.id(), const_cast<char*>(bytes.data()), bytes.size());
    id = H5Fopen("in memory", H5F_ACC_RDONLY, access.id());
    if (id < 0) throw InputError({path, "", "", "", "is not a complete HDF5 file", kCopyAgain});
  }
  ~OpenFile() {
    if (id >= 0) H5Fclose(id);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  std::unique_lock<std::mutex> lock;
  const std::string& path;
  hid_t id = -1;
  std::uint64_t numbers = 0;  ///< read so far, or held in chunks while they were read
};

}  // namespace hdf5

struct Hdf5Object::State {
  State(std::shared_ptr<hdf5::OpenFile> in, hid_t opened, std::string called)
      : file(std::move(in)), object(opened, H5Oclose), name(std::move(called)) {}

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError({file->path, "", in_quotes(name), "", what,
                      "save the numbers as float32 or float64 in plain datasets of one file"});
  }

  std::shared_ptr<hdf5::OpenFile> file;
  hdf5::Handle object;
  std::string name;
};

bool looks_like_hdf5(std::string_view bytes) {
  constexpr std::string_view kSignature("\x89HDF\r\n\x1a\n", 8);
  for (std::size_t at = 0; at < bytes.size(); at = std::max<std::size_t>(512, 2 * at))
    if (bytes.compare(at, kSignature.size(), kSignature) == 0) return true;
  return false;
}

bool Hdf5Object::is_group() const { return H5Iget_type(state_->object.id()) == H5I_GROUP; }

std::vector<std::string> Hdf5Object::links() const {
  H5G_info_t info;
  if (H5Gget_info(state_->object.id(), &info) < 0) state_->refuse("is not a group that can be read");
  if (info.nlinks > kMostHdf5Entries) state_->refuse("holds more than 4096 names");
  std::vector<std::string> names;
  for (hsize_t k = 0; k < info.nlinks; ++k) {
    const auto name_of = [&](char* text, std::size_t size) {
      return H5Lget_name_by_idx(state_->object.id(), ".", H5_INDEX_NAME, H5_ITER_INC, k, text, size,
                                H5P_DEFAULT);
    };
    const ssize_t length = name_of(nullptr, 0);
    if (length < 0 || length > 4096) state_->refuse("holds a name that cannot be read");
    std::string name(static_cast<std::size_t>(length) + 1, '\0');
    name_of(name.data(), name.size());
    name.pop_back();
    names.push_back(std::move(name));
  }
  return names;
}

bool Hdf5Object::has(const std::string& link) const {
  return H5Lexists(state_->object.id(), link.c_str(), H5P_DEFAULT) > 0;
}

Hdf5Object Hdf5Object::open(const std::string& link) const {
  std::string rest = link;
  hid_t at = H5Oopen(state_->object.id(), ".", H5P_DEFAULT);
  while (!rest.empty()) {  // step by step, so that no step leads to another file
    const std::string step = rest.substr(0, rest.find('/'));
    rest.erase(0, std::min(step.size() + 1, rest.size()));
    const hdf5::Handle here(at, H5Oclose);
    H5L_info_t info;
    if (!here.is_open() || H5Lget_info(here.id(), step.c_str(), &info, H5P_DEFAULT) < 0)
      state_->refuse("has no " + in_quotes(link));
    if (info.type == H5L_TYPE_EXTERNAL) state_->refuse(in_quotes(link) + " lies in another file");
    at = H5Oopen(here.id(), step.c_str(), H5P_DEFAULT);
  }
  if (at < 0) state_->refuse(in_quotes(link) + " cannot be read");
  return Hdf5Object(std::make_shared<State>(state_->file, at, state_->name + "/" + link));
}

std::optional<std::vector<std::string>> Hdf5Object::texts(const std::string& attribute) const {
  if (H5Aexists(state_->object.id(), attribute.c_str()) <= 0) return std::nullopt;
  const hdf5::Handle stored(H5Aopen(state_->object.id(), attribute.c_str(), H5P_DEFAULT), H5Aclose);
  const hdf5::Handle type(H5Aget_type(stored.id()), H5Tclose);
  const hdf5::Handle space(H5Aget_space(stored.id()), H5Sclose);
  if (!stored.is_open() || !type.is_open() || H5Tget_class(type.id()) != H5T_STRING)
    state_->refuse("its attribute " + in_quotes(attribute) + " is not text");
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  const std::size_t size = H5Tget_size(type.id());
  if (count < 0 || count > static_cast<hssize_t>(kMostHdf5Entries) || size > (std::size_t{1} << 24))
    state_->refuse("its attribute " + in_quotes(attribute) + " is too long");
  const auto entries = static_cast<std::size_t>(count);
  std::vector<std::string> result;
  if (H5Tis_variable_str(type.id()) > 0) {
    std::vector<char*> texts(entries, nullptr);
    if (H5Aread(stored.id(), type.id(), texts.data()) < 0)
      state_->refuse("its attribute " + in_quotes(attribute) + " cannot be read");
    for (const char* text : texts) result.emplace_back(text == nullptr ? "" : text);
    H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, texts.data());
    return result;
  }
  if (size * entries > (std::size_t{1} << 24))
    state_->refuse("its attribute " + in_quotes(attribute) + " is too long");
  std::string bytes(size * entries, '\0');
  if (H5Aread(stored.id(), type.id(), bytes.data()) < 0)
    state_->refuse("its attribute " + in_quotes(attribute) + " cannot be read");
  for (std::size_t k = 0; k < entries; ++k) {
    const std::string text = bytes.substr(k * size, size);
    result.push_back(text.substr(0, text.find('\0')));
  }
  return result;
}

bool Hdf5Object::flag(const std::string& attribute) const {
  if (H5Aexists(state_->object.id(), attribute.c_str()) <= 0) return false;
  const hdf5::Handle stored(H5Aopen(state_->object.id(), attribute.c_str(), H5P_DEFAULT), H5Aclose);
  const hdf5::Handle type(H5Aget_type(stored.id()), H5Tclose);
  const hdf5::Handle space(H5Aget_space(stored.id()), H5Sclose);
  double value = 0;
  if (!hdf5::is_plain(type.id()))
    state_->refuse("its attribute " + in_quotes(attribute) + " is not a number of a plain type");
  return H5Sget_simple_extent_npoints(space.id()) == 1 &&
         H5Aread(stored.id(), H5T_NATIVE_DOUBLE, &value) >= 0 && value != 0;
}

Hdf5Numbers Hdf5Object::numbers() const {
  if (H5Iget_type(state_->object.id()) != H5I_DATASET) state_->refuse("is not a dataset");
  const hdf5::Handle type(H5Dget_type(state_->object.id()), H5Tclose);
  const hdf5::Handle space(H5Dget_space(state_->object.id()), H5Sclose);
  const hdf5::Handle layout(H5Dget_create_plist(state_->object.id()), H5Pclose);
  if (!hdf5::is_plain(type.id())) state_->refuse("holds numbers of another type");
  const int rank = H5Sget_simple_extent_ndims(space.id());
  if (rank < 0 || rank > 8) state_->refuse("has more than 8 dimensions");
  std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
  if (rank > 0) H5Sget_simple_extent_dims(space.id(), sizes.data(), nullptr);
  const auto few = [](const std::vector<hsize_t>& shape) {
    return element_count({shape.begin(), shape.end()}).has_value();
  };
  if (!few(sizes)) state_->refuse("has more than 2^25 numbers");
  std::uint64_t held = *element_count({sizes.begin(), sizes.end()});
  if (H5Pget_layout(layout.id()) == H5D_CHUNKED) {  // a chunk is held in memory as a whole
    std::vector<hsize_t> chunk(static_cast<std::size_t>(rank));
    H5Pget_chunk(layout.id(), rank, chunk.data());
    if (!few(chunk)) state_->refuse("has chunks of more than 2^25 numbers");
    held = std::max(held, *element_count({chunk.begin(), chunk.end()}));
  }
  if (H5Pget_external_count(layout.id()) > 0) state_->refuse("lies in another file");
  Hdf5Numbers result;
  result.shape.assign(sizes.begin(), sizes.end());
  result.is_float32 = H5Tget_class(type.id()) == H5T_FLOAT && H5Tget_size(type.id()) <= 4;
  state_->file->numbers += held;
  if (state_->file->numbers > kMostElements)
    state_->refuse("and what was read before it have more than 2^25 numbers");
  result.numbers.resize(*element_count(result.shape));
  if (!result.numbers.empty() && H5Dread(state_->object.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL,
                                         H5P_DEFAULT, result.numbers.data()) < 0)
    state_->refuse("cannot be read: the file is damaged, or compressed by a filter that is not known");
  return result;
}

std::vector<Hdf5Object> Hdf5Object::references() const {
  const hdf5::Handle type(H5Dget_type(state_->object.id()), H5Tclose);
  const hdf5::Handle space(H5Dget_space(state_->object.id()), H5Sclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  if (!type.is_open() || H5Tequal(type.id(), H5T_STD_REF_OBJ) <= 0)
    state_->refuse("is a cell array without references");
  if (count < 0 || count > static_cast<hssize_t>(kMostHdf5Entries))
    state_->refuse("has more than 4096 cells");
  std::vector<hobj_ref_t> stored(static_cast<std::size_t>(count));
  if (count > 0 &&
      H5Dread(state_->object.id(), H5T_STD_REF_OBJ, H5S_ALL, H5S_ALL, H5P_DEFAULT, stored.data()) < 0)
    state_->refuse("cannot be read");
  std::vector<Hdf5Object> objects;
  for (const hobj_ref_t& reference : stored) {
    const hid_t object = H5Rdereference2(state_->object.id(), H5P_DEFAULT, H5R_OBJECT, &reference);
    if (object < 0) state_->refuse("refers to nothing");
    objects.push_back(Hdf5Object(std::make_shared<State>(state_->file, object, state_->name)));
  }
  return objects;
}

Hdf5Object Hdf5File::opened(const std::string& bytes, const std::string& path) {
  auto file = std::make_shared<hdf5::OpenFile>(bytes, path);
  const hid_t root = H5Gopen2(file->id, "/", H5P_DEFAULT);
  if (root < 0) throw InputError({path, "", "", "", "is not a complete HDF5 file", kCopyAgain});
  return Hdf5Object(std::make_shared<Hdf5Object::State>(std::move(file), root, ""));
}

Hdf5File::Hdf5File(const std::string& bytes, const std::string& path) : root_(opened(bytes, path)) {}

}  // namespace swarmcert::files
