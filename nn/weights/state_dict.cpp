#include "nn/weights/state_dict.h"

#include <optional>

#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::files {
namespace {

using Kind = PickledValue::Kind;
using Index = std::uint32_t;

constexpr std::size_t kMostKeysListed = 20;
constexpr std::size_t kLongestKey = 200;

class Selector {
 public:
  Selector(const Pickle& pickle, const std::string& path) : pickle_(pickle), path_(path) {}

  StateDict select(const std::string& key) const {
    StateDict result;
    Index index = key.empty() ? pickle_.root : find(key);
    const std::vector<std::string> keys =
        key.empty() && !holds_tensor(index) ? keys_of_state_dicts() : std::vector<std::string>();
    if (keys.size() == 1 && (keys.front() == "state_dict" || keys.front() == "model_state_dict")) {
      result.key = keys.front();
      index = find(result.key);
    }
    const PickledValue& dict = value(index);
    if (dict.kind != Kind::kDict) {
      throw InputError(
          {path_, "", key, name(dict.kind), "is not a state dict (names and tensors)", choose(key)});
    }
    if (dict.items.empty()) throw InputError({path_, "", key, "", "is an empty state dict", choose(key)});
    for (std::size_t i = 0; i + 1 < dict.items.size(); i += 2) {
      const PickledValue& entry_name = value(dict.items[i]);
      const PickledValue& entry = value(dict.items[i + 1]);
      if (entry_name.kind != Kind::kText)
        throw InputError({path_, "", key, name(entry_name.kind), "is a key that is not text", ""});
      const std::string text(entry_name.text);
      if (entry.kind == Kind::kTensor) {
        result.tensors.emplace_back(text, static_cast<std::size_t>(entry.integer));
      } else if (holds_tensor(index)) {
        result.unused.push_back(text + ": " + name(entry.kind) + ", not a tensor");
      } else {
        throw InputError({path_, "", in_quotes(text), name(entry.kind), "is not a tensor", choose(key)});
      }
    }
    result.modules = modules_of(dict);
    return result;
  }

 private:
  const PickledValue& value(Index index) const { return pickle_.values[index]; }

  /// Returns the keys of the dict "_metadata" among the attributes of `dict`.
  std::vector<std::string> modules_of(const PickledValue& dict) const {
    std::vector<std::string> modules;
    if (!dict.attributes) return modules;
    const PickledValue& attributes = value(*dict.attributes);
    for (std::size_t i = 0; attributes.kind == Kind::kDict && i + 1 < attributes.items.size(); i += 2) {
      const PickledValue& metadata = value(attributes.items[i + 1]);
      if (value(attributes.items[i]).text != "_metadata" || metadata.kind != Kind::kDict) continue;
      for (std::size_t k = 0; k < metadata.items.size(); k += 2)
        modules.emplace_back(value(metadata.items[k]).text);
    }
    return modules;
  }

  bool holds_tensor(Index index) const {
    const PickledValue& dict = value(index);
    for (std::size_t i = 0; dict.kind == Kind::kDict && i + 1 < dict.items.size(); i += 2)
      if (value(dict.items[i + 1]).kind == Kind::kTensor) return true;
    return false;
  }

  /// Follows the dotted path `key`. Names in the file may themselves contain dots, so the longest match is taken.
  Index find(const std::string& key) const {
    Index at = pickle_.root;
    std::string_view rest = key;
    for (;;) {
      const PickledValue& dict = value(at);
      std::optional<Index> next;
      std::size_t longest = 0;
      for (std::size_t i = 0; dict.kind == Kind::kDict && i + 1 < dict.items.size(); i += 2) {
        const PickledValue& candidate = value(dict.items[i]);
        if (candidate.kind != Kind::kText || candidate.text.size() < longest || candidate.text.empty())
          continue;
        const bool fits = rest.substr(0, candidate.text.size()) == candidate.text &&
                          (rest.size() == candidate.text.size() || rest[candidate.text.size()] == '.');
        if (!fits) continue;
        next = dict.items[i + 1];
        longest = candidate.text.size();
      }
      if (!next) throw InputError({path_, "", "", in_quotes(key), "the file has no such key", choose(key)});
      at = *next;
      if (longest == rest.size()) return at;
      rest.remove_prefix(longest + 1);
    }
  }

  /// Returns the hint: other keys that lead to a dict with tensors.
  std::string choose(const std::string& key) const {
    std::vector<std::string> keys = keys_of_state_dicts();
    if (keys.empty()) return "save one with torch.save(model.state_dict(), ...)";
    if (!key.empty()) {
      const std::string best = nearest(key, keys);
      if (!best.empty()) return "did you mean " + in_quotes(best) + "?";
    }
    std::string list = "choose a state dict with --key: ";
    for (std::size_t i = 0; i < keys.size(); ++i) list += (i == 0 ? "" : ", ") + in_quotes(keys[i]);
    return list;
  }

  /// Breadth-first search that visits each dict once, because a pickle may contain itself.
  std::vector<std::string> keys_of_state_dicts() const {
    std::vector<std::string> keys;
    std::vector<std::pair<std::string, Index>> queue = {{"", pickle_.root}};
    std::vector<bool> seen(pickle_.values.size(), false);
    seen[pickle_.root] = true;
    for (std::size_t head = 0; head < queue.size() && keys.size() < kMostKeysListed; ++head) {
      const auto [prefix, index] = queue[head];
      const PickledValue& dict = value(index);
      for (std::size_t i = 0; i + 1 < dict.items.size(); i += 2) {
        const PickledValue& entry_name = value(dict.items[i]);
        const Index child = dict.items[i + 1];
        if (value(child).kind != Kind::kDict || entry_name.kind != Kind::kText || seen[child]) continue;
        if (prefix.size() + entry_name.text.size() > kLongestKey) continue;
        seen[child] = true;
        queue.emplace_back((prefix.empty() ? "" : prefix + ".") + std::string(entry_name.text), child);
      }
      if (holds_tensor(index) && !prefix.empty()) keys.push_back(prefix);
    }
    return keys;
  }

  const Pickle& pickle_;
  const std::string& path_;
};

}  // namespace

StateDict select_state_dict(const Pickle& pickle, const std::string& key, const std::string& path) {
  return Selector(pickle, path).select(key);
}

}  // namespace swarmcert::files
