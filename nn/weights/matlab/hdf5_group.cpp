#include "nn/weights/matlab/hdf5_group.h"

#include <string_view>

#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

constexpr std::size_t kMostLinks = 4096;
constexpr std::uint64_t kGroupNode = 0;
constexpr std::uint64_t kSymbolicLink = 2;
constexpr char kOtherLink[] = "only hard links are supported";

void add(std::vector<Hdf5Link>& links, Hdf5Link link, const Hdf5Piece& piece) {
  if (links.size() == kMostLinks) piece.refuse("", "", "a group has more than 4096 links", kSaveAsVersion7);
  links.push_back(std::move(link));
}

class SymbolTable {
 public:
  SymbolTable(Hdf5File& file, Hdf5Piece message) : file_(file), names_(message) {
    tree_ = message.number(8);
    Hdf5Piece heap = file.from(message.number(8));
    heap.expect("HEAP");
    heap.require("version of a local heap", heap.number(1), 0);
    heap.skip(3);
    const std::uint64_t size = heap.number(8);
    heap.skip(8);  // free list
    names_ = file.at(heap.number(8), size);
  }

  std::vector<Hdf5Link> run() {
    read_tree(tree_, std::nullopt);
    return std::move(links_);
  }

 private:
  void read_tree(std::uint64_t address, std::optional<std::uint64_t> parent_level) {
    Hdf5TreeNode node = file_.tree_node(address, kGroupNode, parent_level);
    node.entries.skip(8);  // the first key
    for (std::uint64_t k = 0; k < node.count; ++k) {
      file_.count_entry(node.entries);
      const std::uint64_t child = node.entries.number(8);
      node.entries.skip(8);  // the next key
      if (node.level == 0) {
        read_symbols(child);
      } else {
        read_tree(child, node.level);
      }
    }
  }

  void read_symbols(std::uint64_t address) {
    Hdf5Piece node = file_.from(address);
    node.expect("SNOD");
    node.require("version of a symbol table's node", node.number(1), 1);
    node.skip(1);
    const std::uint64_t count = node.number(2);
    for (std::uint64_t k = 0; k < count; ++k) {
      file_.count_entry(node);
      const std::uint64_t name = node.number(8), object = node.number(8), kind = node.number(4);
      node.skip(4 + 16);  // reserved, scratch
      if (kind == kSymbolicLink) node.refuse("link", in_quotes(name_at(name)), kOtherLink, kSaveAsVersion7);
      add(links_, {name_at(name), object}, node);
    }
  }

  std::string name_at(std::uint64_t offset) const {
    Hdf5Piece heap = names_;
    heap.skip(offset);
    const std::string_view rest = heap.take(heap.left());
    const std::size_t end = rest.find('\0');
    if (end == std::string_view::npos)
      names_.refuse("", "", "a name in a local heap is not terminated", kCopyAgain);
    return std::string(rest.substr(0, end));
  }

  Hdf5File& file_;
  std::uint64_t tree_ = 0;
  Hdf5Piece names_;
  std::vector<Hdf5Link> links_;
};

Hdf5Link link_of(Hdf5Piece message) {
  message.require("version of a link", message.number(1), 1);
  const std::uint64_t flags = message.number(1);
  const std::uint64_t kind = (flags & 0x8) != 0 ? message.number(1) : 0;
  if ((flags & 0x4) != 0) message.skip(8);   // creation order
  if ((flags & 0x10) != 0) message.skip(1);  // character set
  const std::uint64_t length = message.number(std::size_t{1} << (flags & 3));
  const std::string name(message.take(length));
  if (kind != 0) message.refuse("link", in_quotes(name), kOtherLink, kSaveAsVersion7);
  return {name, message.number(8)};
}

}  // namespace

bool is_group(const Hdf5Object& object) {
  for (const Hdf5Message& message : object.messages)
    if (message.kind == Hdf5Kind::kSymbolTable || message.kind == Hdf5Kind::kLinkInfo) return true;
  return false;
}

std::vector<Hdf5Link> links_of(Hdf5File& file, const Hdf5Object& group) {
  if (const std::optional<Hdf5Piece> table = group.find(Hdf5Kind::kSymbolTable))
    return SymbolTable(file, *table).run();
  std::vector<Hdf5Link> links;
  if (std::optional<Hdf5Piece> info = group.find(Hdf5Kind::kLinkInfo)) {
    info->require("version of a group's links", info->number(1), 0);
    if ((info->number(1) & 1) != 0) info->skip(8);  // maximum creation order
    if (info->number(8) != kNoAddress)
      info->refuse("", "", "a group keeps its links in a fractal heap, which is not supported",
                   kSaveAsVersion7);
  }
  for (const Hdf5Message& message : group.messages) {
    if (message.kind != Hdf5Kind::kLink) continue;
    if (message.is_shared)
      message.contents.refuse("header message", "6", "is shared with another object", kSaveAsVersion7);
    add(links, link_of(message.contents), message.contents);
  }
  return links;
}

}  // namespace swarmcert::files
