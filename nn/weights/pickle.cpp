#include "nn/weights/pickle.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <initializer_list>
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
enum Callable : std::int64_t {
  kOrderedDict,
  kRebuildTensor,
  kRebuildParameter,
  kNewArray,
  kArrayOfBytes,
  kNewNumberType,
  kEncode,
  kPassedOver
};

/// Types and functions whose results are passed over: they hold settings, and none of them is called.
bool is_passed_over(std::string_view module, std::string_view global) {
  const auto is_one_of = [](std::string_view word, std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (is_one_of(module, {"builtins", "__builtin__"}))
    return is_one_of(global, {"set", "frozenset", "complex", "bytearray", "slice", "range", "xrange",
                              "object", "list", "dict", "tuple", "int", "float", "bool", "str", "bytes"});
  if (is_one_of(module, {"copy_reg", "copyreg"})) return global == "_reconstructor";
  if (module == "torch")
    return is_one_of(global, {"device", "Size", "dtype", "float32", "float64", "float16"});
  if (module == "numpy" || module.substr(0, 6) == "numpy.")
    return module.substr(0, 12) == "numpy.random" ||
           is_one_of(global, {"scalar", "ndarray", "float64", "float32", "int64", "int32", "bool_"});
  for (const std::string_view package : {"stable_baselines3.", "gymnasium.spaces", "gym.spaces"})
    if (module.substr(0, package.size()) == package) return true;
  return is_one_of(module, {"argparse", "datetime", "pathlib", "pathlib._local", "decimal", "fractions",
                            "uuid", "collections"}) ||
         (module == "types" && global == "SimpleNamespace") || (module == "enum" && global == "Enum");
}

double big_endian_double(std::string_view bytes) {
  std::uint64_t bits = 0;
  for (const char byte : bytes) bits = bits << 8 | static_cast<unsigned char>(byte);
  double number;
  std::memcpy(&number, &bits, sizeof number);
  return number;
}

/// Returns torch's name for the type of a NumPy array, or nothing.
std::string_view storage_type(std::string_view number_type) {
  if (number_type == "f4") return "FloatStorage";
  if (number_type == "f8") return "DoubleStorage";
  if (number_type == "f2") return "HalfStorage";
  if (number_type == "i8") return "LongStorage";
  if (number_type == "i4") return "IntStorage";
  if (number_type == "i2") return "ShortStorage";
  if (number_type == "i1") return "CharStorage";
  if (number_type == "u1") return "ByteStorage";
  if (number_type == "b1") return "BoolStorage";
  return {};
}

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
        return build(pop());
      case 0x81:    // NEWOBJ
      case 0x92: {  // NEWOBJ_EX
        const std::size_t count = opcode == 0x81 ? 2 : 3;
        const Index type = pop_last(count)[0];
        if (value(type).kind != Kind::kGlobal) refuse("an object is made of something that is not a type");
        const bool is_dict = value(type).integer == kOrderedDict;
        return push(make(is_dict ? Kind::kDict : Kind::kOpaque));
      }
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
        if (width > 8) return take(width), push(make(Kind::kOpaque)), true;
        return push(make(Kind::kInteger, take_signed(static_cast<int>(width)))), true;
      }
      case 'G':  // big-endian
        push(make(Kind::kReal));
        return top().real = big_endian_double(take(8)), true;
      case 'U':  // SHORT_BINSTRING, written by Python 2
      case 0x8c:
        return push(make(Kind::kText, 0, take(take_unsigned(1)))), true;
      case 'T':  // BINSTRING
      case 'X':
        return push(make(Kind::kText, 0, take(take_unsigned(4)))), true;
      case 0x8d:
        return push(make(Kind::kText, 0, take(take_unsigned(8)))), true;
      case 'C':  // SHORT_BINBYTES
        return push(make(Kind::kBytes, 0, take(take_unsigned(1)))), true;
      case 'B':  // BINBYTES
        return push(make(Kind::kBytes, 0, take(take_unsigned(4)))), true;
      case 0x8e:  // BINBYTES8
      case 0x96:  // BYTEARRAY8
        return push(make(Kind::kBytes, 0, take(take_unsigned(8)))), true;
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
      case 0x8f:  // EMPTY_SET
        return push(make(Kind::kOpaque)), true;
      case 0x90:  // ADDITEMS
        pop_to_mark();
        return peek(), true;
      case 0x91:  // FROZENSET
        pop_to_mark();
        return push(make(Kind::kOpaque)), true;
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
    if (list.kind == Kind::kOpaque) return;
    if (list.kind != Kind::kList) refuse("values are appended to something that is not a list");
    list.items.insert(list.items.end(), items.begin(), items.end());
  }

  void set_items(const std::vector<Index>& items) {
    PickledValue& dict = top();
    if (dict.kind == Kind::kOpaque) return;
    if (dict.kind != Kind::kDict) refuse("items are set in something that is not a dict");
    if (items.size() % 2 != 0) refuse("a dict has a key without a value");
    dict.items.insert(dict.items.end(), items.begin(), items.end());
  }

  void push_global(std::string_view module, std::string_view global) {
    const bool is_dict = module == "collections" && (global == "OrderedDict" || global == "defaultdict");
    if (is_dict) return push(make(Kind::kGlobal, kOrderedDict));
    const bool is_numpy = module == "numpy" || module.substr(0, 6) == "numpy.";
    if (is_numpy && global == "_reconstruct") return push(make(Kind::kGlobal, kNewArray));
    if (is_numpy && global == "_frombuffer") return push(make(Kind::kGlobal, kArrayOfBytes));
    if (is_numpy && global == "dtype") return push(make(Kind::kGlobal, kNewNumberType));
    if (module == "_codecs" && global == "encode") return push(make(Kind::kGlobal, kEncode));
    if (module == "torch._utils" && global == "_rebuild_tensor_v2")
      return push(make(Kind::kGlobal, kRebuildTensor));
    if (module == "torch._utils" && global == "_rebuild_parameter")
      return push(make(Kind::kGlobal, kRebuildParameter));
    constexpr std::string_view kSuffix = "Storage";
    const bool is_storage = (module == "torch" || module == "torch.storage") &&
                            global.size() > kSuffix.size() &&
                            global.substr(global.size() - kSuffix.size()) == kSuffix;
    if (is_storage) return push(make(Kind::kStorageType, 0, global));
    if (is_passed_over(module, global)) return push(make(Kind::kGlobal, kPassedOver));
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
      case kNewArray:
        return push(make(Kind::kArray));
      case kArrayOfBytes:  // (bytes, type, shape, order)
        if (items.size() != 4 || value(items[3]).kind != Kind::kText) refuse("an array is incomplete");
        return push(
            make(Kind::kTensor, add_array(items[1], items[2], items[0], value(items[3]).text == "F")));
      case kNewNumberType:
        if (items.empty() || value(items[0]).kind != Kind::kText) return push(make(Kind::kOpaque));
        return push(make(Kind::kNumberType, 0, value(items[0]).text));
      case kEncode:
        return push(make(Kind::kBytes, 0, latin1(items)));
      case kPassedOver:
        return push(make(Kind::kOpaque));
      default:
        for (const Index item : items) {  // of defaultdict: the type of missing values
          const PickledValue& argument = value(item);
          const bool is_type = argument.kind == Kind::kNone ||
                               (argument.kind == Kind::kGlobal && argument.integer == kPassedOver);
          if (!is_type) refuse("an OrderedDict is created from arguments", kSaveStateDict);
        }
        return push(make(Kind::kDict));
    }
  }

  /// Sets the state of the object on top of the stack. torch attaches version numbers (_metadata) to a state dict.
  void build(Index state) {
    const Kind kind = top().kind;
    if (kind == Kind::kDict) top().attributes = state;
    if (kind == Kind::kOpaque) top().items = {state};
    if (kind == Kind::kDict || kind == Kind::kOpaque) return;
    const std::vector<Index> items = few_items(state);
    if (kind == Kind::kNumberType) {  // (version, byte order, ...)
      if (items.size() < 2 || value(items[1]).kind != Kind::kText)
        refuse("the type of an array is incomplete");
      top().integer = value(items[1]).text == ">" ? 1 : 0;
      return;
    }
    if (kind != Kind::kArray || items.size() != 5)  // (version, shape, type, is in Fortran's order, bytes)
      refuse("attributes are set on something that is not a dict", kSaveStateDict);
    const std::int64_t tensor = add_array(items[2], items[1], items[4], value(items[3]).integer == 1);
    top().kind = Kind::kTensor;
    top().integer = tensor;
  }

  /// Returns the bytes of a text in which each character stands for one: ("...", "latin1").
  std::string_view latin1(const std::vector<Index>& items) {
    if (items.size() != 2 || value(items[0]).kind != Kind::kText || value(items[1]).text != "latin1")
      refuse("text is encoded in another way than latin1");
    const std::string_view text = value(items[0]).text;
    std::string bytes;
    bytes.reserve(text.size());
    for (std::size_t at = 0; at < text.size(); ++at) {
      const auto first = static_cast<unsigned char>(text[at]);
      if (first < 0x80) {
        bytes += text[at];
      } else if ((first == 0xc2 || first == 0xc3) && at + 1 < text.size()) {
        bytes += static_cast<char>((first & 3) << 6 | (static_cast<unsigned char>(text[++at]) & 0x3f));
      } else {
        refuse("text that stands for bytes has other characters");
      }
    }
    pickle_.decoded.push_back(std::move(bytes));
    return pickle_.decoded.back();
  }

  /// Adds a NumPy array, whose numbers are in the pickle, as a tensor.
  std::int64_t add_array(Index number_type, Index shape, Index bytes, bool columns_first) {
    if (value(number_type).kind != Kind::kNumberType || value(bytes).kind != Kind::kBytes)
      refuse("an array lacks its type or its numbers");
    if (value(number_type).integer == 1)
      refuse("the numbers of an array are not little-endian", kSaveStateDict);
    PickledTensor tensor;
    tensor.storage = pickle_.storages.size();
    tensor.offset = 0;
    tensor.sizes = counts(shape, "the shape of an array");
    std::uint64_t elements = 1;
    bool overflows = false;
    tensor.strides.resize(tensor.sizes.size());
    for (std::size_t k = 0; k < tensor.sizes.size(); ++k) {
      const std::size_t d = columns_first ? k : tensor.sizes.size() - 1 - k;
      tensor.strides[d] = elements;
      overflows = overflows || __builtin_mul_overflow(elements, tensor.sizes[d], &elements);
    }
    const std::string_view type = value(number_type).text;
    const std::uint64_t width =
        type.size() == 2 && type[1] >= '1' && type[1] <= '8' ? type[1] - std::uint64_t{'0'} : 0;
    if (overflows || storage_type(type).empty() || width * elements != value(bytes).text.size() ||
        elements > value(bytes).text.size())
      refuse("an array is of another type or size than its numbers", kSaveStateDict);
    pickle_.storages.push_back({storage_type(type), "", elements, true, value(bytes).text});
    pickle_.tensors.push_back(std::move(tensor));
    return static_cast<std::int64_t>(pickle_.tensors.size() - 1);
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
    pickle_.storages.push_back({value(items[1]).text, value(items[2]).text, elements, false, {}});
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
    case Kind::kBytes:
      return "bytes";
    case Kind::kNumberType:
      return "a type of numbers";
    case Kind::kArray:
      return "an array without numbers";
    case Kind::kOpaque:
      return "an object of Python";
  }
  return "";
}

}  // namespace swarmcert::files
