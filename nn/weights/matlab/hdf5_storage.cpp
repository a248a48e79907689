#include "nn/weights/matlab/hdf5_storage.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/inflate.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::uint64_t kCompact = 0, kContiguous = 1, kChunked = 2;
constexpr std::uint64_t kDeflate = 1, kShuffle = 2;
constexpr std::uint64_t kChunkNode = 1;
/// A zlib stream decompresses to at most 1032 times its size; the margin covers any header.
constexpr std::uint64_t kMostExpansion = 1040;

struct Layout {
  std::uint64_t kind = kCompact;
  std::uint64_t address = kNoAddress;
  std::uint64_t size_bytes = 0;      ///< of contiguous elements; 0: not stated
  std::vector<std::uint64_t> chunk;  ///< shape of a chunk, then the size of an element
  std::optional<Hdf5Piece> compact_elements;
};

std::vector<std::uint64_t> chunk_shape(Hdf5Piece& message, std::uint64_t rank) {
  std::vector<std::uint64_t> chunk;
  for (std::uint64_t k = 0; k < rank; ++k) chunk.push_back(message.number(4));
  return chunk;
}

/// Reads layout versions 1 and 2, written by early versions of MATLAB.
Layout early_layout(Hdf5Piece& message) {
  Layout layout;
  const std::uint64_t rank = message.number(1);
  layout.kind = message.number(1);
  message.skip(5);
  if (layout.kind != kCompact) layout.address = message.number(8);
  layout.chunk = chunk_shape(message, rank);
  if (layout.kind == kCompact) layout.compact_elements = message.piece(message.number(4));
  return layout;
}

Layout layout_of(Hdf5Piece message) {
  const std::uint64_t version = message.number(1);
  if (version == 1 || version == 2) return early_layout(message);
  if (version != 3 && version != 4)
    message.refuse("layout version", std::to_string(version), "only 1 to 4 are read", kSaveAsVersion7);
  Layout layout;
  layout.kind = message.number(1);
  if (layout.kind == kCompact) {
    layout.compact_elements = message.piece(message.number(2));
  } else if (layout.kind == kContiguous) {
    layout.address = message.number(8);
    layout.size_bytes = message.number(8);
  } else if (layout.kind == kChunked) {
    message.require("layout version of chunks", version, 3);
    const std::uint64_t rank = message.number(1);
    layout.address = message.number(8);
    layout.chunk = chunk_shape(message, rank);
  }
  return layout;
}

/// Returns the identifiers of the filters in the order in which the writer applied them; each is known and occurs once.
std::vector<std::uint64_t> filters_of(const Hdf5Object& dataset) {
  std::vector<std::uint64_t> filters;
  std::optional<Hdf5Piece> message = dataset.find(Hdf5Kind::kFilters);
  if (!message) return filters;
  const std::uint64_t version = message->number(1), count = message->number(1);
  if (version != 1) message->require("version of the filters", version, 2);
  if (version == 1) message->skip(6);
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::uint64_t filter = message->number(2);
    if ((filter != kDeflate && filter != kShuffle) ||
        std::find(filters.begin(), filters.end(), filter) != filters.end())
      message->refuse("filter", std::to_string(filter), "only deflate and shuffle are supported, each once",
                      kSaveAsVersion7);
    const std::uint64_t name_bytes = version == 1 ? message->number(2) : 0;
    message->skip(2);  // whether the filter is optional
    const std::uint64_t values = message->number(2);
    message->skip(name_bytes + 4 * values + (version == 1 && values % 2 == 1 ? 4 : 0));
    filters.push_back(filter);
  }
  return filters;
}

/// Undoes the shuffle filter: the first bytes of all elements come first, then the second ones, ...; the bytes of an
/// incomplete last element come last.
std::string unshuffled(const std::string& shuffled, std::size_t element_bytes) {
  const std::size_t count = shuffled.size() / element_bytes;
  std::string result = shuffled;
  for (std::size_t byte = 0; byte < element_bytes; ++byte)
    for (std::size_t k = 0; k < count; ++k) result[k * element_bytes + byte] = shuffled[byte * count + k];
  return result;
}

std::uint64_t product(const std::vector<std::uint64_t>& factors, const Hdf5Piece& piece, const char* field) {
  const std::optional<std::uint64_t> count = element_count(factors);
  if (!count || *count == 0)
    piece.refuse(field, shape_text(factors), "is empty or too large", kSaveAsVersion7);
  return *count;
}

class Chunks {
 public:
  Chunks(Hdf5File& file, const Hdf5Object& dataset, const Hdf5Piece& message, const Layout& layout,
         const std::vector<std::uint64_t>& shape, std::size_t element_bytes)
      : file_(file), shape_(shape), chunk_(layout.chunk), element_bytes_(element_bytes) {
    if (chunk_.size() != shape.size() + 1 || shape.empty() || chunk_.back() != element_bytes)
      message.refuse("shape of chunks", shape_text(chunk_),
                     "does not fit a dataset of shape " + shape_text(shape), kCopyAgain);
    chunk_.pop_back();
    filters_ = filters_of(dataset);
    chunk_bytes_ = product(chunk_, message, "shape of chunks") * element_bytes;
    std::vector<std::uint64_t> counts;
    for (std::size_t k = 0; k < shape.size(); ++k) counts.push_back((shape[k] - 1) / chunk_[k] + 1);
    const std::uint64_t count = product(counts, message, "number of chunks");
    if (count > file.size_bytes() || chunk_bytes_ / kMostExpansion > file.size_bytes())
      message.refuse("shape of chunks", shape_text(layout.chunk), "the file is too small for such chunks",
                     kCopyAgain);
    is_read_.assign(static_cast<std::size_t>(count), false);
    address_ = layout.address;
    elements_.assign(static_cast<std::size_t>(*element_count(shape)) * element_bytes, '\0');
  }

  std::string run() {
    read_tree(address_, std::nullopt);
    const auto missing = static_cast<std::size_t>(std::count(is_read_.begin(), is_read_.end(), false));
    if (missing > 0)
      file_.from(address_).refuse("chunks", std::to_string(is_read_.size() - missing),
                                  "a dataset lacks " + std::to_string(missing) + " of its chunks",
                                  kSaveAsVersion7);
    return std::move(elements_);
  }

 private:
  void read_tree(std::uint64_t address, std::optional<std::uint64_t> parent_level) {
    Hdf5TreeNode node = file_.tree_node(address, kChunkNode, parent_level);
    for (std::uint64_t k = 0; k < node.count; ++k) {
      file_.count_entry(node.entries);
      const std::uint64_t size = node.entries.number(4), skipped_filters = node.entries.number(4);
      std::vector<std::uint64_t> corner;
      for (std::size_t axis = 0; axis < shape_.size(); ++axis) corner.push_back(node.entries.number(8));
      node.entries.skip(8);  // offset within an element
      const std::uint64_t child = node.entries.number(8);
      if (node.level > 0) {
        read_tree(child, node.level);
      } else {
        mark_read(corner, node.entries);
        place(contents(file_.at(child, size), skipped_filters), corner);
      }
    }
  }

  void mark_read(const std::vector<std::uint64_t>& corner, const Hdf5Piece& node) {
    std::uint64_t place = 0;
    for (std::size_t k = 0; k < shape_.size(); ++k) {
      if (corner[k] >= shape_[k] || corner[k] % chunk_[k] != 0)
        node.refuse("corner of a chunk", shape_text(corner),
                    "is not a multiple of its shape inside the dataset", kCopyAgain);
      place = place * ((shape_[k] - 1) / chunk_[k] + 1) + corner[k] / chunk_[k];
    }
    if (is_read_[static_cast<std::size_t>(place)])
      node.refuse("corner of a chunk", shape_text(corner), "two chunks overlap", kCopyAgain);
    is_read_[static_cast<std::size_t>(place)] = true;
  }

  /// Reads one chunk and undoes the filters in reverse order, except those that the writer skipped.
  std::string contents(Hdf5Piece stored, std::uint64_t skipped_filters) {
    file_.count_bytes(std::max<std::uint64_t>(chunk_bytes_, stored.left()), stored);
    std::string bytes(stored.take(stored.left()));
    for (std::size_t k = filters_.size(); k-- > 0;) {
      if ((skipped_filters >> k & 1) != 0) continue;
      if (filters_[k] == kShuffle) {
        bytes = unshuffled(bytes, element_bytes_);
        continue;
      }
      std::optional<std::string> inner = inflated(bytes, chunk_bytes_);
      if (!inner) stored.refuse("", "", "the compressed data of a chunk are damaged", kCopyAgain);
      bytes = std::move(*inner);
    }
    if (bytes.size() != chunk_bytes_)
      stored.refuse("", "", "a chunk does not have " + std::to_string(chunk_bytes_) + " bytes", kCopyAgain);
    return bytes;
  }

  /// Copies the part of a chunk that lies inside the dataset, row by row along the last axis.
  void place(const std::string& chunk, const std::vector<std::uint64_t>& corner) {
    const std::size_t last = shape_.size() - 1;
    std::vector<std::uint64_t> extent;
    for (std::size_t k = 0; k <= last; ++k) extent.push_back(std::min(chunk_[k], shape_[k] - corner[k]));
    const std::size_t row_bytes = static_cast<std::size_t>(extent[last]) * element_bytes_;
    std::uint64_t rows = 1;
    for (std::size_t k = 0; k < last; ++k) rows *= extent[k];
    for (std::uint64_t row = 0; row < rows; ++row) {
      std::uint64_t rest = row, from = 0, to = corner[last];
      std::uint64_t from_stride = chunk_[last], to_stride = shape_[last];
      for (std::size_t k = last; k-- > 0;) {
        const std::uint64_t index = rest % extent[k];
        rest /= extent[k];
        from += index * from_stride;
        to += (corner[k] + index) * to_stride;
        from_stride *= chunk_[k];
        to_stride *= shape_[k];
      }
      std::copy_n(chunk.begin() + static_cast<std::ptrdiff_t>(from * element_bytes_), row_bytes,
                  elements_.begin() + static_cast<std::ptrdiff_t>(to * element_bytes_));
    }
  }

  Hdf5File& file_;
  const std::vector<std::uint64_t>& shape_;
  std::vector<std::uint64_t> chunk_;
  std::size_t element_bytes_;
  std::vector<std::uint64_t> filters_;
  std::uint64_t chunk_bytes_ = 0;
  std::uint64_t address_ = kNoAddress;
  std::vector<bool> is_read_;
  std::string elements_;
};

}  // namespace

std::string stored_bytes(Hdf5File& file, const Hdf5Object& dataset, const std::vector<std::uint64_t>& shape,
                         std::size_t element_bytes) {
  const std::optional<Hdf5Piece> message = dataset.find(Hdf5Kind::kLayout);
  if (!message || dataset.find(Hdf5Kind::kExternalFiles))
    file.from(0).refuse("dataset at offset", std::to_string(dataset.offset),
                        message ? "its elements are stored in another file" : "has no layout",
                        kSaveAsVersion7);
  const std::uint64_t size = *element_count(shape) * element_bytes;
  if (size == 0) return "";
  if (size / kMostExpansion > file.size_bytes())
    message->refuse("shape", shape_text(shape), "the file is too small for this number of elements",
                    kCopyAgain);
  file.count_bytes(8 * (size / element_bytes), *message);
  const Layout layout = layout_of(*message);
  if (layout.kind == kChunked) return Chunks(file, dataset, *message, layout, shape, element_bytes).run();
  if (layout.kind != kCompact && layout.kind != kContiguous)
    message->refuse("layout", std::to_string(layout.kind), "is neither compact, contiguous nor chunked",
                    kSaveAsVersion7);
  Hdf5Piece elements = layout.compact_elements ? *layout.compact_elements : file.at(layout.address, size);
  if (elements.left() != size || (layout.size_bytes != 0 && layout.size_bytes != size))
    message->refuse("shape", shape_text(shape), "does not fit the size of the elements", kCopyAgain);
  return std::string(elements.take(size));
}

}  // namespace swarmcert::files
