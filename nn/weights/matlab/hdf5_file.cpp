#include "nn/weights/matlab/hdf5_file.h"

#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

constexpr std::uint64_t kMostGroupEntries = std::uint64_t{1} << 20;
constexpr std::uint64_t kMostRead_bytes = std::uint64_t{1} << 27;
constexpr std::size_t kMostMessages = 1024;
constexpr std::size_t kMostContinuations = 64;
constexpr std::uint64_t kDeepestTree = 16;
constexpr int kSharedFlag = 0x2;

}  // namespace

std::string_view Hdf5Piece::take(std::uint64_t size) {
  if (size > left())
    refuse("", "", "needs " + std::to_string(size) + " bytes where " + std::to_string(left()) + " are left",
           kCopyAgain);
  const std::string_view taken = data_.substr(at_, static_cast<std::size_t>(size));
  at_ += taken.size();
  return taken;
}

std::uint64_t Hdf5Piece::number(std::size_t size) {
  const std::string_view bytes = take(size);
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

Hdf5Piece Hdf5Piece::piece(std::uint64_t size) {
  const std::size_t begin = offset();
  return {take(size), begin, *path_};
}

void Hdf5Piece::skip_padding() { skip((8 - at_ % 8) % 8); }

void Hdf5Piece::expect(std::string_view signature) {
  const std::size_t begin = offset();
  if (take(signature.size()) != signature)
    throw InputError({*path_, "offset " + std::to_string(begin), "", "",
                      "lacks the signature " + in_quotes(signature) + " of HDF5", kCopyAgain});
}

void Hdf5Piece::require(const char* field, std::uint64_t number, std::uint64_t expected) const {
  if (number != expected)
    refuse(field, std::to_string(number), "only " + std::to_string(expected) + " is read", kSaveAsVersion7);
}

void Hdf5Piece::refuse(const std::string& field, const std::string& value, const std::string& what,
                       const std::string& hint) const {
  throw InputError({*path_, "offset " + std::to_string(offset()), field, value, what, hint});
}

std::optional<Hdf5Piece> Hdf5Object::find(Hdf5Kind kind) const {
  const Hdf5Message* found = nullptr;
  for (const Hdf5Message& message : messages) {
    if (message.kind != kind) continue;
    const std::string type = std::to_string(static_cast<int>(kind));
    if (found != nullptr) message.contents.refuse("header message", type, "appears twice", kCopyAgain);
    if (message.is_shared)
      message.contents.refuse("header message", type, "is shared with another object", kSaveAsVersion7);
    found = &message;
  }
  if (found == nullptr) return std::nullopt;
  return found->contents;
}

Hdf5File::Hdf5File(const std::string& bytes, std::size_t start, const std::string& path)
    : bytes_(bytes), start_(start), path_(path) {
  Hdf5Piece piece = from(0);
  piece.expect(std::string_view("\x89HDF\r\n\x1a\n", 8));
  const std::uint64_t version = piece.number(1);
  if (version != 0 && version != 2 && version != 3)
    piece.refuse("superblock version", std::to_string(version), "only 0, 2 and 3 are read", kSaveAsVersion7);
  root_ = version == 0 ? symbol_table_root(piece) : plain_root(piece);
}

/// Superblock version 0: the root group is a symbol table entry.
std::uint64_t Hdf5File::symbol_table_root(Hdf5Piece& piece) {
  piece.require("version of the free space", piece.number(1), 0);
  piece.require("version of the symbol table", piece.number(1), 0);
  piece.skip(1);
  piece.require("version of shared headers", piece.number(1), 0);
  piece.require("size of addresses", piece.number(1), 8);
  piece.require("size of lengths", piece.number(1), 8);
  piece.skip(1 + 2 + 2 + 4);  // node sizes, flags
  piece.require("base address", piece.number(8), start_);
  piece.skip(8);  // free space
  const std::uint64_t end = piece.number(8);
  if (end > bytes_.size())
    piece.refuse("end of the file", std::to_string(end), "lies beyond the end", kCopyAgain);
  piece.skip(8 + 8);  // driver information; name of the root
  return piece.number(8);
}

std::uint64_t Hdf5File::plain_root(Hdf5Piece& piece) {
  piece.require("size of addresses", piece.number(1), 8);
  piece.require("size of lengths", piece.number(1), 8);
  piece.skip(1);  // flags
  piece.require("base address", piece.number(8), start_);
  piece.skip(8);  // extension
  const std::uint64_t end = piece.number(8);
  if (end > bytes_.size())
    piece.refuse("end of the file", std::to_string(end), "lies beyond the end", kCopyAgain);
  return piece.number(8);
}

Hdf5Piece Hdf5File::from(std::uint64_t address) const {
  if (bytes_.size() < start_ || address > bytes_.size() - start_)
    throw InputError({path_, "", "address", address == kNoAddress ? "undefined" : std::to_string(address),
                      "lies beyond the end of the file", kCopyAgain});
  const std::size_t offset = start_ + static_cast<std::size_t>(address);
  return {std::string_view(bytes_).substr(offset), offset, path_};
}

Hdf5Piece Hdf5File::at(std::uint64_t address, std::uint64_t size) const { return from(address).piece(size); }

Hdf5TreeNode Hdf5File::tree_node(std::uint64_t address, std::uint64_t type,
                                 std::optional<std::uint64_t> parent_level) const {
  Hdf5Piece node = from(address);
  node.expect("TREE");
  node.require("type of a B-tree's node", node.number(1), type);
  const std::uint64_t level = node.number(1);
  if (parent_level ? level + 1 != *parent_level : level > kDeepestTree)
    node.refuse("level of a B-tree's node", std::to_string(level),
                parent_level ? "is not one below its parent's" : "is more than 16", kCopyAgain);
  const std::uint64_t count = node.number(2);
  node.skip(8 + 8);  // siblings
  return {level, count, node};
}

void Hdf5File::count_entry(const Hdf5Piece& piece) {
  if (++entries_ > kMostGroupEntries)
    piece.refuse("", "", "the file has more entries than any network needs", kSaveAsVersion7);
}

void Hdf5File::count_bytes(std::uint64_t size, const Hdf5Piece& piece) {
  if (size > kMostRead_bytes - read_bytes_)
    piece.refuse("", "", "the file holds more than 128 MiB of numbers",
                 "save it in MATLAB with save(..., '-v6')");
  read_bytes_ += size;
}

Hdf5Object Hdf5File::object(std::uint64_t address) {
  Hdf5Piece piece = from(address);
  Hdf5Object object;
  object.offset = piece.offset();
  std::vector<Hdf5Piece> continuations;
  int version = static_cast<int>(piece.number(1)), flags = 0;
  if (version == 1) {
    piece.skip(1 + 2 + 4);  // number of messages and reference count
    const std::uint64_t size = piece.number(4);
    piece.skip(4);
    read_messages(piece.piece(size), version, flags, object, continuations);
  } else {
    piece = from(address);
    piece.expect("OHDR");
    version = static_cast<int>(piece.number(1));
    piece.require("version of an object header", static_cast<std::uint64_t>(version), 2);
    flags = static_cast<int>(piece.number(1));
    if ((flags & 0x20) != 0) piece.skip(16);  // times
    if ((flags & 0x10) != 0) piece.skip(4);   // thresholds of the attribute storage
    const std::uint64_t size = piece.number(std::size_t{1} << (flags & 3));
    read_messages(piece.piece(size), version, flags, object, continuations);
  }
  for (std::size_t k = 0; k < continuations.size(); ++k) {
    Hdf5Piece where = continuations[k];
    if (k >= kMostContinuations)
      where.refuse("", "", "an object header has more than 64 continuations", kCopyAgain);
    const std::uint64_t block_address = where.number(8), size = where.number(8);
    Hdf5Piece block = at(block_address, size);
    if (version == 2) {
      block.expect("OCHK");
      if (block.left() < 4) block.refuse("", "", "a continuation lacks its checksum", kCopyAgain);
      block = block.piece(block.left() - 4);
    }
    read_messages(block, version, flags, object, continuations);
  }
  return object;
}

void Hdf5File::read_messages(Hdf5Piece block, int version, int header_flags, Hdf5Object& object,
                             std::vector<Hdf5Piece>& continuations) {
  const bool has_creation_order = version == 2 && (header_flags & 0x4) != 0;
  const std::size_t head_bytes = version == 1 ? 8 : has_creation_order ? 6 : 4;
  while (block.left() >= head_bytes) {
    count_entry(block);
    const auto kind = static_cast<Hdf5Kind>(block.number(version == 1 ? 2 : 1));
    const std::uint64_t size = block.number(2);
    const bool is_shared = (block.number(1) & kSharedFlag) != 0;
    block.skip(head_bytes - (version == 1 ? 5 : 4));
    const Hdf5Piece contents = block.piece(size);
    if (kind == Hdf5Kind::kContinuation) {
      continuations.push_back(contents);
    } else {
      object.messages.push_back({kind, is_shared, contents});
    }
    if (object.messages.size() > kMostMessages)
      block.refuse("", "", "an object header has more than 1024 messages", kCopyAgain);
  }
}

}  // namespace swarmcert::files
