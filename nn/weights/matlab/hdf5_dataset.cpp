#include "nn/weights/matlab/hdf5_dataset.h"

#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/matlab/hdf5_storage.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::uint64_t kMostRank = 8;
constexpr std::uint64_t kInteger = 0, kFloat = 1, kText = 3, kCompound = 6, kReference = 7;
constexpr std::uint64_t kMostText_bytes = 4096;
constexpr char kSaveAsDouble[] = "convert in MATLAB with double(...) or single(...) and save again";

std::vector<std::uint64_t> shape_of(Hdf5Piece message) {
  const std::uint64_t version = message.number(1), rank = message.number(1);
  if (version != 1) message.require("version of a dataspace", version, 2);
  message.skip(1);  // whether maximum sizes follow
  const std::uint64_t kind = message.number(1);
  if (version == 1) message.skip(4);
  if (version == 2 && kind > 1)
    message.refuse("type of a dataspace", std::to_string(kind), "has no extent", kSaveAsVersion7);
  if (rank > kMostRank)
    message.refuse("dimensions", std::to_string(rank), "a dataset has more than 8", kSaveAsVersion7);
  std::vector<std::uint64_t> shape;
  for (std::uint64_t k = 0; k < rank; ++k) shape.push_back(message.number(8));
  if (!element_count(shape))
    message.refuse("shape", shape_text(shape),
                   "holds more than " + std::to_string(kMostElements) + " numbers", "");
  return shape;
}

/// Checks the fields of the IEEE formats: size, sign, exponent, fraction, bias.
void require_ieee(Hdf5Piece message, std::uint64_t bits, std::size_t size) {
  const bool is_double = size == 8;
  if (!is_double) message.require("bytes of a float", size, 4);
  message.require("byte order", bits & 0x41, 0);
  message.require("normalization of a float", bits >> 4 & 3, 2);
  message.require("sign of a float", bits >> 8 & 0xff, is_double ? 63 : 31);
  message.require("first bit of a float", message.number(2), 0);
  message.require("bits of a float", message.number(2), 8 * size);
  message.require("first bit of an exponent", message.number(1), is_double ? 52 : 23);
  message.require("bits of an exponent", message.number(1), is_double ? 11 : 8);
  message.require("first bit of a fraction", message.number(1), 0);
  message.require("bits of a fraction", message.number(1), is_double ? 52 : 23);
  message.require("bias of an exponent", message.number(4), is_double ? 1023 : 127);
}

Hdf5Type type_of(Hdf5Piece message) {
  const std::uint64_t head = message.number(1), bits = message.number(3);
  const std::uint64_t version = head >> 4, type_class = head & 0xf;
  if (version < 1 || version > 3)
    message.refuse("version of a datatype", std::to_string(version), "only 1 to 3 are supported",
                   kSaveAsVersion7);
  const auto size = static_cast<std::size_t>(message.number(4));
  switch (type_class) {
    case kInteger:
      if (size == 0 || size > 8)
        message.refuse("bytes of an integer", std::to_string(size), "is not between 1 and 8",
                       kSaveAsVersion7);
      message.require("byte order", bits & 1, 0);
      message.require("first bit of an integer", message.number(2), 0);
      message.require("bits of an integer", message.number(2), 8 * size);
      return {Hdf5Class::kInteger, size, (bits & 8) != 0};
    case kFloat:
      require_ieee(message, bits, size);
      return {Hdf5Class::kFloat, size, true};
    case kText:
      if (size == 0 || size > kMostText_bytes)
        message.refuse("bytes of a text", std::to_string(size), "is not between 1 and 4096", kSaveAsVersion7);
      return {Hdf5Class::kText, size, false};
    case kReference:
      message.require("kind of a reference", bits & 0xf, 0);
      message.require("bytes of a reference", size, 8);
      return {Hdf5Class::kReference, size, false};
    case kCompound:
      message.refuse("class of a datatype", "6", "holds records or complex numbers", kSaveAsDouble);
    default:
      message.refuse("class of a datatype", std::to_string(type_class),
                     "is neither integer, float, text nor reference", kSaveAsDouble);
  }
}

struct Attribute {
  std::string name;
  Hdf5Piece type, shape, elements;
};

/// Supports versions 1 to 3; in version 1 every part is padded to a multiple of 8 bytes.
Attribute attribute_parts(Hdf5Piece message) {
  const std::uint64_t version = message.number(1);
  if (version < 1 || version > 3)
    message.refuse("version of an attribute", std::to_string(version), "only 1 to 3 are supported",
                   kSaveAsVersion7);
  const std::uint64_t flags = message.number(1);
  const std::uint64_t name_bytes = message.number(2), type_bytes = message.number(2);
  const std::uint64_t shape_bytes = message.number(2);
  if (version == 3) message.skip(1);  // character set
  const auto part = [&message, version](std::uint64_t size) {
    const Hdf5Piece taken = message.piece(size);
    if (version == 1) message.skip_padding();
    return taken;
  };
  const std::string name(part(name_bytes).take(name_bytes));
  const Hdf5Piece type = part(type_bytes), shape = part(shape_bytes);
  const std::string plain = name.substr(0, name.find('\0'));
  if (version > 1 && flags != 0)
    message.refuse("attribute", in_quotes(plain), "has a type that is stored elsewhere", kSaveAsVersion7);
  return {plain, type, shape, message};
}

Hdf5Piece needed(Hdf5File& file, const Hdf5Object& dataset, Hdf5Kind kind, const char* what) {
  const std::optional<Hdf5Piece> message = dataset.find(kind);
  if (!message)
    file.from(0).refuse("object at offset", std::to_string(dataset.offset), std::string("has no ") + what,
                        kCopyAgain);
  return *message;
}

}  // namespace

Hdf5Array array_of(Hdf5File& file, const Hdf5Object& dataset) {
  Hdf5Array array;
  array.offset = dataset.offset;
  array.shape = shape_of(needed(file, dataset, Hdf5Kind::kDataspace, "dataspace"));
  array.type = type_of(needed(file, dataset, Hdf5Kind::kDatatype, "datatype"));
  array.bytes = stored_bytes(file, dataset, array.shape, array.type.size_bytes);
  return array;
}

std::optional<Hdf5Array> attribute_of(Hdf5File& file, const Hdf5Object& object, const std::string& name) {
  for (const Hdf5Message& message : object.messages) {
    if (message.kind == Hdf5Kind::kAttributeInfo) {
      Hdf5Piece info = message.contents;
      info.require("version of an object's attributes", info.number(1), 0);
      if ((info.number(1) & 1) != 0) info.skip(2);  // maximum creation order
      if (info.number(8) != kNoAddress)
        info.refuse("", "", "an object keeps its attributes in a fractal heap, which is not supported",
                    kSaveAsVersion7);
    }
  }
  for (const Hdf5Message& message : object.messages) {
    if (message.kind != Hdf5Kind::kAttribute || message.is_shared) continue;
    Attribute found = attribute_parts(message.contents);
    if (found.name != name) continue;
    Hdf5Array array;
    array.offset = found.elements.offset();
    array.shape = shape_of(found.shape);
    array.type = type_of(found.type);
    const std::uint64_t size = *element_count(array.shape) * array.type.size_bytes;
    file.count_bytes(size, found.elements);
    array.bytes = std::string(found.elements.take(size));
    return array;
  }
  return std::nullopt;
}

std::vector<double> numbers_of(const Hdf5Array& array, const std::string& name, const std::string& path) {
  const std::size_t size = array.type.size_bytes, count = array.bytes.size() / size;
  const bool is_float = array.type.type_class == Hdf5Class::kFloat;
  const bool is_small_integer = array.type.type_class == Hdf5Class::kInteger && size <= 4;
  if (!is_float && !is_small_integer)
    throw InputError({path, "offset " + std::to_string(array.offset), in_quotes(name), "",
                      "holds numbers of an unsupported type", kSaveAsDouble});
  std::vector<double> numbers;
  numbers.reserve(count);
  if (is_float) {
    append_numbers(array.bytes.data(), count, 1, size == 8 ? Precision::kFloat64 : Precision::kFloat32,
                   numbers);
    return numbers;
  }
  for (std::size_t k = 0; k < count; ++k) {
    std::int64_t value = 0;
    for (std::size_t i = size; i-- > 0;)
      value = value << 8 | static_cast<unsigned char>(array.bytes[k * size + i]);
    const std::int64_t values = std::int64_t{1} << 8 * size;
    numbers.push_back(
        static_cast<double>(array.type.is_signed && value >= values / 2 ? value - values : value));
  }
  return numbers;
}

}  // namespace swarmcert::files
