#include "nn/weights/pickle.h"

#include <algorithm>
#include <cstdio>
#include <unordered_map>
#include <utility>

#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

using Kind = PickledValue::Kind;
using Index = std::uint32_t;

constexpr std::size_t kMostDimensions = 8;
constexpr std::size_t kMostArguments = 8;  // _rebuild_tensor_v2 takes seven
constexpr char kSaveStateDict[] = "save the weights alone: torch.save(model.state_dict(), ...)";

/// Functions that a state dict may call; PickledValue::integer of a kGlobal.
enum Callable : std::int64_t { kOrderedDict, kRebuildTensor, kRebuildParameter };

class Machine {
 public:
  Machine(std::string_view bytes, std::size_t begin, const std::string& path, const std::string& entry)
      : bytes_(bytes), position_(begin), path_(path), entry_(entry) {}

  Pickle run() {
    for (std::size_t operations = 0;; ++operations) {
      opcode_at_ = position_;
      if (operations == kMostPickleOperations)
        refuse("more opcodes than any state dict needs", kSaveStateDict);
      const auto opcode = static_cast<unsigned char>(take(1)[0]);
      if (opcode == '.') break;
      execute(opcode);
    }
    pickle_.root = pop();
    if (!stack_.empty() || !marks_.empty()) refuse("the pickle leaves values on its stack");
    pickle_.end = position_;
    return std::move(pickle_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what, const std::string& hint = "",
                           const std::string& value = "") {
    throw InputError({path_, "offset " + std::to_string(opcode_at_), entry_, value, what, hint});
  }

  // --- bytes

  std::string_view take(std::uint64_t count) {
    if (count > bytes_.size() - position_) {
      refuse("the pickle ends prematurely", "the file is truncated or damaged: copy it again");
    }
    const std::string_view taken = bytes_.substr(position_, static_cast<std::size_t>(count));
    position_ += static_cast<std::size_t>(count);
    return taken;
  }

  std::uint64_t take_unsigned(int width) {  // little-endian
    const std::string_view digits = take(static_cast<std::uint64_t>(width));
    std::uint64_t value = 0;
    for (int i = width - 1; i >= 0; --i) {
      value = value << 8 | static_cast<unsigned char>(digits[static_cast<std::size_t>(i)]);
    }
    return value;
  }

  std::int64_t take_signed(int width) {  // two's complement of 0 to 8 bytes
    if (width == 0) return 0;
    const std::uint64_t sign = std::uint64_t{1} << (8 * width - 1);
    return static_cast<std::int64_t>((take_unsigned(width) ^ sign) - sign);
  }

  std::string_view take_line() {
    const std::size_t end = bytes_.find('\n', position_);
    if (end == std::string_view::npos)
      refuse("a name is not terminated", "the file is truncated or damaged: copy it again");
    const std::string_view line = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    return line;
  }

  // --- stack, marks, memo

  PickledValue& value(Index index) { return pickle_.values[index]; }
  PickledValue& top() { return value(peek()); }

  Index make(Kind kind, std::int64_t integer = 0, std::string_view text = {}, std::vector<Index> items = {}) {
    pickle_.values.push_back({kind, integer, text, std::move(items)});
    return static_cast<Index>(pickle_.values.size() - 1);
  }
  void push(Index index) { stack_.push_back(index); }

  std::size_t floor() const { return marks_.empty() ? 0 : marks_.back(); }
  Index peek() {
    if (stack_.size() <= floor()) refuse("an opcode finds too few values on the stack");
    return stack_.back();
  }
  Index pop() {
    const Index index = peek();
    stack_.pop_back();
    return index;
  }
  std::vector<Index> pop_last(std::size_t count) {
    if (stack_.size() - floor() < count) refuse("an opcode finds too few values on the stack");
    return cut(stack_.size() - count);
  }
  std::vector<Index> pop_to_mark() {
    if (marks_.empty()) refuse("an opcode finds no mark on the stack");
    const std::size_t from = marks_.back();
    marks_.pop_back();
    return cut(from);
  }
  std::vector<Index> cut(std::size_t from) {
    const auto first = stack_.begin() + static_cast<std::ptrdiff_t>(from);
    std::vector<Index> items(first, stack_.end());
    stack_.erase(first, stack_.end());
    return items;
  }

  void remember(std::uint64_t slot) { memo_[slot] = peek(); }
  void recall(std::uint64_t slot) {
    const auto found = memo_.find(slot);
    if (found == memo_.end()) refuse("an opcode recalls a value that was never stored");
    push(found->second);
  }

  // --- semantics of the opcodes

  void execute(unsigned char opcode) {
    if (push_scalar(opcode) || build_container(opcode) || use_memo(opcode)) return;
    switch (opcode) {
      case 0x80:  // PROTO
        if (take_unsigned(1) > 5) refuse("the pickle protocol is newer than 5");
        return;
      case 0x95:
        take(8);
        return;  // FRAME: a hint for buffering
      case '(':
        return marks_.push_back(stack_.size());
      case 'c': {  // GLOBAL
        const std::string_view module = take_line();
        return push_global(module, take_line());
      }
      case 0x93: {  // STACK_GLOBAL
        const std::vector<Index> names = pop_last(2);
        if (value(names[0]).kind != Kind::kText || value(names[1]).kind != Kind::kText)
          refuse("a name is not text");
        return push_global(value(names[0]).text, value(names[1]).text);
      }
      case 'R':
        return reduce();
      case 'b':  // BUILD: torch attaches version numbers (_metadata) to the dict
        pop();
        if (top().kind != Kind::kDict)
          refuse("attributes are set on something that is not a dict", kSaveStateDict);
        return;
      case 'Q':
        return load_persistent();
      default: {
        char text[8];
        std::snprintf(text, sizeof text, "0x%02x", opcode);
        refuse("this pickle opcode is not part of a state dict", kSaveStateDict, text);
      }
    }
  }

  /// These three return false for opcodes of another group.
  bool push_scalar(unsigned char opcode) {
    switch (opcode) {
      case 'N':
        return push(make(Kind::kNone)), true;
      case 0x88:
      case 0x89:
        return push(make(Kind::kBool, opcode == 0x88)), true;
      case 'K':
        return push(make(Kind::kInteger, static_cast<std::int64_t>(take_unsigned(1)))), true;
      case 'M':
        return push(make(Kind::kInteger, static_cast<std::int64_t>(take_unsigned(2)))), true;
      case 'J':
        return push(make(Kind::kInteger, take_signed(4))), true;
      case 0x8a: {  // LONG1
        const std::uint64_t width = take_unsigned(1);
        if (width > 8) refuse("an integer has more than 64 bits");
        return push(make(Kind::kInteger, take_signed(static_cast<int>(width)))), true;
      }
      case 'G':
        take(8);
        return push(make(Kind::kReal)), true;
      case 'U':  // SHORT_BINSTRING, written by Python 2
      case 0x8c:
        return push(make(Kind::kText, 0, take(take_unsigned(1)))), true;
      case 'T':  // BINSTRING
      case 'X':
        return push(make(Kind::kText, 0, take(take_unsigned(4)))), true;
      case 0x8d:
        return push(make(Kind::kText, 0, take(take_unsigned(8)))), true;
      default:
        return false;
    }
  }

  bool build_container(unsigned char opcode) {
    switch (opcode) {
      case ')':
        return push(make(Kind::kTuple)), true;
      case 't':
        return push(make(Kind::kTuple, 0, {}, pop_to_mark())), true;
      case 0x85:
      case 0x86:
      case 0x87:
        return push(make(Kind::kTuple, 0, {}, pop_last(opcode - std::size_t{0x84}))), true;
      case ']':
        return push(make(Kind::kList)), true;
      case 'a':
        return append(pop_last(1)), true;
      case 'e':
        return append(pop_to_mark()), true;
      case '}':
        return push(make(Kind::kDict)), true;
      case 's':
        return set_items(pop_last(2)), true;
      case 'u':
        return set_items(pop_to_mark()), true;
      default:
        return false;
    }
  }

  bool use_memo(unsigned char opcode) {
    switch (opcode) {
      case 'q':
        return remember(take_unsigned(1)), true;
      case 'r':
        return remember(take_unsigned(4)), true;
      case 0x94:
        return remember(memo_.size()), true;
      case 'h':
        return recall(take_unsigned(1)), true;
      case 'j':
        return recall(take_unsigned(4)), true;
      default:
        return false;
    }
  }

  void append(const std::vector<Index>& items) {
    PickledValue& list = top();
    if (list.kind != Kind::kList) refuse("values are appended to something that is not a list");
    list.items.insert(list.items.end(), items.begin(), items.end());
  }

  void set_items(const std::vector<Index>& items) {
    PickledValue& dict = top();
    if (dict.kind != Kind::kDict) refuse("items are set in something that is not a dict");
    if (items.size() % 2 != 0) refuse("a dict has a key without a value");
    dict.items.insert(dict.items.end(), items.begin(), items.end());
  }

  void push_global(std::string_view module, std::string_view global) {
    if (module == "collections" && global == "OrderedDict") return push(make(Kind::kGlobal, kOrderedDict));
    if (module == "torch._utils" && global == "_rebuild_tensor_v2")
      return push(make(Kind::kGlobal, kRebuildTensor));
    if (module == "torch._utils" && global == "_rebuild_parameter")
      return push(make(Kind::kGlobal, kRebuildParameter));
    constexpr std::string_view kSuffix = "Storage";
    const bool is_storage = (module == "torch" || module == "torch.storage") &&
                            global.size() > kSuffix.size() &&
                            global.substr(global.size() - kSuffix.size()) == kSuffix;
    if (is_storage) return push(make(Kind::kStorageType, 0, global));
    refuse(
        "the file holds a Python object of this type, which only Python code could rebuild; nothing was "
        "executed",
        kSaveStateDict, in_quotes(std::string(module) + "." + std::string(global)));
  }

  void reduce() {
    const Index arguments = pop();
    const Index callable = pop();
    if (value(callable).kind != Kind::kGlobal || value(arguments).kind != Kind::kTuple) {
      refuse("something that is not a function of torch is called", kSaveStateDict);
    }
    const std::vector<Index> items = few_items(arguments);
    switch (value(callable).integer) {
      case kRebuildTensor:
        return push(make(Kind::kTensor, add_tensor(items)));
      case kRebuildParameter:
        if (items.empty() || value(items[0]).kind != Kind::kTensor) refuse("a parameter has no tensor");
        return push(items[0]);
      default:
        if (!items.empty()) refuse("an OrderedDict is created from arguments", kSaveStateDict);
        return push(make(Kind::kDict));
    }
  }

  /// Returns a copy, because make() moves the values. Its length is limited: a file can request a million copies.
  std::vector<Index> few_items(Index tuple) {
    if (value(tuple).items.size() > kMostArguments) refuse("a function gets more than 8 arguments");
    return value(tuple).items;
  }

  /// ("storage", type, key, location, elements[, view])
  void load_persistent() {
    const Index id = pop();
    const std::vector<Index> items = few_items(id);
    const bool is_storage = value(id).kind == Kind::kTuple && items.size() >= 5 &&
                            value(items[0]).text == "storage" && value(items[1]).kind == Kind::kStorageType &&
                            value(items[2]).kind == Kind::kText;
    if (!is_storage) refuse("a reference to raw data is not a torch storage", kSaveStateDict);
    if (items.size() > 5 && value(items[5]).kind != Kind::kNone) {
      refuse("a storage is a view of another storage", "save again with torch 0.4 or newer");
    }
    const std::uint64_t elements = count(items[4], "the size of a storage");
    pickle_.storages.push_back({value(items[1]).text, value(items[2]).text, elements});
    push(make(Kind::kStorage, static_cast<std::int64_t>(pickle_.storages.size() - 1)));
  }

  /// (storage, offset, size, stride, requires_grad, hooks[, metadata])
  std::int64_t add_tensor(const std::vector<Index>& items) {
    if (items.size() < 4 || value(items[0]).kind != Kind::kStorage) refuse("a tensor has no storage");
    PickledTensor tensor;
    tensor.storage = static_cast<std::size_t>(value(items[0]).integer);
    tensor.offset = count(items[1], "the offset of a tensor");
    tensor.sizes = counts(items[2], "the shape of a tensor");
    tensor.strides = counts(items[3], "the strides of a tensor");
    if (tensor.sizes.size() != tensor.strides.size())
      refuse("a tensor has different numbers of strides and sizes");
    pickle_.tensors.push_back(std::move(tensor));
    return static_cast<std::int64_t>(pickle_.tensors.size() - 1);
  }

  std::uint64_t count(Index index, const std::string& what) {
    const PickledValue& number = value(index);
    if (number.kind != Kind::kInteger) refuse(what + " is not an integer");
    if (number.integer < 0) refuse(what + " is negative", "", std::to_string(number.integer));
    return static_cast<std::uint64_t>(number.integer);
  }

  std::vector<std::uint64_t> counts(Index index, const std::string& what) {
    const PickledValue& tuple = value(index);
    if (tuple.kind != Kind::kTuple) refuse(what + " is not a tuple");
    if (tuple.items.size() > kMostDimensions) refuse(what + " has more than 8 dimensions");
    std::vector<std::uint64_t> result;
    for (const Index item : tuple.items) result.push_back(count(item, what));
    return result;
  }

  std::string_view bytes_;
  std::size_t position_;
  std::size_t opcode_at_ = 0;
  const std::string& path_;
  const std::string& entry_;
  Pickle pickle_;
  std::vector<Index> stack_;
  std::vector<std::size_t> marks_;
  std::unordered_map<std::uint64_t, Index> memo_;
};

}  // namespace

Pickle parse_pickle(std::string_view bytes, std::size_t begin, const std::string& path,
                    const std::string& entry) {
  return Machine(bytes, std::min(begin, bytes.size()), path, entry).run();
}

const char* name(PickledValue::Kind kind) {
  switch (kind) {
    case Kind::kNone:
      return "None";
    case Kind::kBool:
      return "a Boolean";
    case Kind::kInteger:
      return "an integer";
    case Kind::kReal:
      return "a number";
    case Kind::kText:
      return "text";
    case Kind::kTuple:
      return "a tuple";
    case Kind::kList:
      return "a list";
    case Kind::kDict:
      return "a dict";
    case Kind::kGlobal:
      return "a function";
    case Kind::kStorageType:
      return "a storage type";
    case Kind::kStorage:
      return "a storage";
    case Kind::kTensor:
      return "a tensor";
  }
  return "";
}

}  // namespace swarmcert::files
