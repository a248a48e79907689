#include "nn/weights/layer_order.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "nn/base/input_error.h"
#include "nn/base/suggest.h"
#include "nn/weights/layer_names.h"

namespace swarmcert::files {
namespace {

using Order = std::vector<std::size_t>;

constexpr std::size_t kMostSearched = 256;   ///< largest number of layers whose orders are enumerated
constexpr std::size_t kMostSteps = 100'000;  ///< limit of that search; beyond it the order is undecided
constexpr std::size_t kMostShown = 3;
constexpr char kByShapes[] =
    "the order of the layers: the shapes allow no other, but the names do not state it";

/// Depth-first search for orders in which the sizes of consecutive layers match.
class OrderSearch {
 public:
  /// @param preferred indices of all layers, in the order in which to try them.
  /// @param by_number only orders consistent with the numbers in the names.
  OrderSearch(const std::vector<LayerShape>& layers, Order preferred, bool by_number)
      : layers_(layers), preferred_(std::move(preferred)), used_(layers.size(), false) {
    if (!by_number) return;
    earlier_.resize(layers.size());
    for (std::size_t i = 0; i < layers.size(); ++i) {
      for (std::size_t j = 0; j < layers.size(); ++j) {
        if (numbered_before(layers[j].name, layers[i].name)) earlier_[i].push_back(j);
      }
    }
  }

  /// Returns at most `most` orders; is_complete() tells whether there are no others.
  std::vector<Order> run(std::size_t most) {
    most_ = most;
    extend();
    return found_;
  }
  bool is_complete() const { return is_complete_; }

 private:
  bool may_follow(std::size_t i) const {
    if (used_[i]) return false;
    if (!current_.empty() && layers_[i].inputs != layers_[current_.back()].outputs) return false;
    return earlier_.empty() || std::all_of(earlier_[i].begin(), earlier_[i].end(),
                                           [this](std::size_t j) { return static_cast<bool>(used_[j]); });
  }

  void extend() {
    if (current_.size() == layers_.size()) {
      if (found_.size() == most_) {
        is_complete_ = false;
      } else {
        found_.push_back(current_);
      }
      return;
    }
    for (const std::size_t i : preferred_) {
      if (!is_complete_) return;
      if (!may_follow(i)) continue;
      if (++steps_ > kMostSteps) {
        is_complete_ = false;
        return;
      }
      used_[i] = true;
      current_.push_back(i);
      extend();
      current_.pop_back();
      used_[i] = false;
    }
  }

  const std::vector<LayerShape>& layers_;
  const Order preferred_;
  std::vector<bool> used_;
  std::vector<Order> earlier_;  ///< for each layer, those that must precede it by number
  Order current_;
  std::vector<Order> found_;
  std::size_t most_ = 0, steps_ = 0;
  bool is_complete_ = true;
};

class OrderDecision {
 public:
  OrderDecision(const std::vector<LayerShape>& layers, Listing listing, const std::string& path)
      : layers_(layers), listing_(listing), path_(path), listed_(layers.size()) {
    std::iota(listed_.begin(), listed_.end(), std::size_t{0});
    natural_ = listed_;
    std::stable_sort(natural_.begin(), natural_.end(), [&](std::size_t a, std::size_t b) {
      return naturally_before(layers_[a].name, layers_[b].name);
    });
  }

  LayerOrder as_stated(const std::vector<std::string>& stated) const {
    Order order;
    std::set<std::string> seen;
    for (const std::string& layer : stated) {
      const auto found = std::find_if(layers_.begin(), layers_.end(),
                                      [&layer](const LayerShape& one) { return one.name == layer; });
      if (found == layers_.end()) refuse(in_quotes(layer), "the file has no such layer", choose(layer));
      if (!seen.insert(layer).second) refuse(in_quotes(layer), "is named twice", "name every layer once");
      order.push_back(static_cast<std::size_t>(found - layers_.begin()));
    }
    if (listing_ == Listing::kEvaluation) {
      if (order != listed_)
        refuse(words(order), "the file itself states another order: " + words(listed_),
               "leave the order out");
      return {order, OrderSource::kFile, {}};
    }
    check_chain(order, "the order does not fit the shapes");
    return {order, OrderSource::kUser, {}};
  }

  LayerOrder decide() const {
    if (listing_ == Listing::kEvaluation) {
      check_chain(listed_, "");
      return {listed_, OrderSource::kFile, {}};
    }
    require_one_module();
    const bool is_registered = listing_ == Listing::kRegistration;
    if (are_all_numbered() && fits(natural_) && (!is_registered || natural_ == listed_))
      return {natural_, layers_.size() == 1 ? OrderSource::kShapes : OrderSource::kNames,
              guesses(gap_in_numbers(names()))};
    if (layers_.size() > kMostSearched) {
      if (!fits(listed_) && !fits(natural_)) check_chain(listed_, "");
      refuse_undecided({});
    }
    OrderSearch any(layers_, is_registered ? listed_ : natural_, false);
    const std::vector<Order> fitting = any.run(kMostShown);
    if (fitting.empty() && any.is_complete())
      check_chain(is_registered ? listed_ : natural_, "no order of the layers fits their shapes");
    if (fitting.size() == 1 && any.is_complete())
      return {fitting.front(), OrderSource::kShapes, guesses(kByShapes)};
    OrderSearch numbered(layers_, natural_, true);
    const std::vector<Order> by_number = numbered.run(1);
    if (by_number.size() == 1 && numbered.is_complete() && (!is_registered || by_number.front() == listed_))
      return {by_number.front(), OrderSource::kNames, guesses(kByShapes)};
    std::vector<Order> candidates = fitting;
    candidates.insert(candidates.begin(), by_number.begin(), by_number.end());
    refuse_undecided(candidates);
  }

 private:
  [[noreturn]] void refuse(const std::string& value, const std::string& what, const std::string& hint) const {
    throw InputError({path_, "", "order", value, what, hint});
  }

  std::string words(const Order& order) const {
    std::string text;
    for (const std::size_t i : order) text += (text.empty() ? "" : ",") + layers_[i].name;
    return text;
  }

  std::vector<std::string> names() const {
    std::vector<std::string> result;
    for (const LayerShape& one : layers_) result.push_back(one.name);
    return result;
  }

  static std::vector<std::string> guesses(const std::string& guess) {
    return guess.empty() ? std::vector<std::string>() : std::vector<std::string>{guess};
  }

  /// Layers of an actor and of a critic may fit one another by their shapes alone.
  void require_one_module() const {
    const std::vector<std::string> modules = modules_of(names());
    if (modules.size() < 2) return;
    std::string list, options;
    for (const std::string& module : modules) {
      list += (list.empty() ? "" : ", ") + in_quotes(module);
      options += (options.empty() ? "" : " or ") + ("--select " + module);
    }
    throw InputError(
        {path_, "", "", "",
         "holds layers of several modules, " + list + ", and does not say whether one follows another",
         "name the one to certify: " + options +
             "; for a chain of several name them in the order of evaluation: --select A,B, or its "
             "layers: --order A.0,A.2,B.0"});
  }

  std::string choose(const std::string& layer) const {
    const std::string best = nearest(layer, names());
    return best.empty() ? "its layers are " + words(listed_) : "did you mean " + in_quotes(best) + "?";
  }

  bool fits(const Order& order) const {
    for (std::size_t k = 1; k < order.size(); ++k) {
      if (layers_[order[k]].inputs != layers_[order[k - 1]].outputs) return false;
    }
    return true;
  }

  /// Returns whether the numbers in the names order every pair of layers; it suffices to compare adjacent ones.
  bool are_all_numbered() const {
    for (std::size_t k = 1; k < natural_.size(); ++k) {
      if (!numbered_before(layers_[natural_[k - 1]].name, layers_[natural_[k]].name)) return false;
    }
    return true;
  }

  void check_chain(const Order& order, const std::string& hint) const {
    for (std::size_t k = 1; k < order.size(); ++k) {
      const LayerShape& before = layers_[order[k - 1]];
      const LayerShape& layer = layers_[order[k]];
      if (layer.inputs == before.outputs) continue;
      const auto weight = [](const LayerShape& one) {
        return one.name.empty() ? std::string("weight") : one.name + ".weight";
      };
      throw InputError(
          {path_, "", weight(layer),
           "[" + std::to_string(layer.outputs) + ", " + std::to_string(layer.inputs) + "]",
           "takes " + std::to_string(layer.inputs) + " inputs, but " + weight(before) + " before it gives " +
               std::to_string(before.outputs) + " outputs",
           hint.empty() ? "the layers must follow one another in the order of evaluation" : hint});
    }
  }

  /// Throws an error that lists the plausible orders: by number, as registered, by name, and others that fit.
  [[noreturn]] void refuse_undecided(std::vector<Order> candidates) const {
    const bool is_registered = listing_ == Listing::kRegistration;
    if (fits(natural_)) candidates.insert(candidates.begin(), natural_);
    if (is_registered && fits(listed_)) candidates.insert(candidates.begin(), listed_);
    std::string list;
    std::vector<Order> shown;
    for (const Order& order : candidates) {
      if (std::find(shown.begin(), shown.end(), order) != shown.end()) continue;
      if (shown.size() == kMostShown) break;
      shown.push_back(order);
      std::string remark;
      if (is_registered && order == listed_) remark = "as registered";
      if (order == natural_) remark += remark.empty() ? "by name" : " and by name";
      list += (list.empty() ? "" : "; ") + words(order) + (remark.empty() ? "" : " (" + remark + ")");
    }
    throw InputError(
        {path_, "", "", "",
         "the file does not say in which order its layers are evaluated, and more than one fits: " + list,
         "give the network's own order with --order A,B,C, or in network.toml as order = [...] beside "
         "weights"});
  }

  const std::vector<LayerShape>& layers_;
  const Listing listing_;
  const std::string& path_;
  Order listed_, natural_;
};

}  // namespace

LayerOrder decide_layer_order(const std::vector<LayerShape>& layers, Listing listing,
                              const LayerChoice& choice, const std::string& path) {
  const OrderDecision decision(layers, listing, path);
  if (!choice.order.empty()) return decision.as_stated(choice.order);
  if (choice.select.size() < 2) return decision.decide();
  LayerOrder chain{{}, OrderSource::kUser, {}};
  std::vector<std::string> stated;
  std::vector<bool> is_taken(layers.size(), false);
  for (const std::string& prefix : choice.select) {
    std::vector<LayerShape> own;
    for (std::size_t i = 0; i < layers.size(); ++i) {
      if (is_taken[i] || !has_prefix(layers[i].name, prefix)) continue;
      is_taken[i] = true;
      own.push_back(layers[i]);
    }
    const LayerOrder order = OrderDecision(own, listing, path).decide();
    for (const std::size_t i : order.indices) stated.push_back(own[i].name);
    chain.assumed.insert(chain.assumed.end(), order.assumed.begin(), order.assumed.end());
  }
  chain.indices = OrderDecision(layers, Listing::kUnordered, path).as_stated(stated).indices;
  return chain;
}

OrderSource stated_order(const std::vector<Layer>& layers, const LayerChoice& choice,
                         const std::string& path) {
  if (!choice.select.empty())
    throw InputError({path, "", "--select", in_quotes(choice.select.front()),
                      "is for files that hold several networks by name; this one states its only chain",
                      "leave --select out"});
  std::vector<LayerShape> shapes;
  for (const Layer& layer : layers)
    shapes.push_back(
        {layer.name, static_cast<std::uint64_t>(layer.inputs), static_cast<std::uint64_t>(layer.outputs)});
  return decide_layer_order(shapes, Listing::kEvaluation, choice.order, path).source;
}

}  // namespace swarmcert::files
