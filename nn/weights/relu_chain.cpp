#include "nn/weights/relu_chain.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

/// Collects the distinct rows of a ReLU layer.
class Rows {
 public:
  explicit Rows(int inputs) { map.inputs = inputs; }

  int add(const AffineMap::Row& row, const Enclosed& shift) {
    const bool is_copy = row.size() == 1 && shift.value == 0 && shift.radius == 0;
    if (is_copy) {  // the common case of a value that is only carried
      const auto [found, is_new] = copies_.emplace(
          std::make_pair(row[0].column, std::make_pair(row[0].factor.value, row[0].factor.radius)),
          map.outputs());
      if (!is_new) return found->second;
    }
    map.rows.push_back(row);
    map.shift.push_back(shift);
    return map.outputs() - 1;
  }

  AffineMap map;

 private:
  std::map<std::pair<int, std::pair<double, double>>, int> copies_;
};

AffineMap::Row negated(AffineMap::Row row) {
  for (AffineEntry& entry : row) entry.factor.value = -entry.factor.value;
  return row;
}

}  // namespace

bool ReluChain::is_never_negative(const AffineMap::Row& row, const Enclosed& shift) const {
  const auto is_at_least_0 = [](const Enclosed& number) { return number.value >= number.radius; };
  if (!is_at_least_0(shift)) return false;
  if (layers_.empty()) return row.empty();
  if (last_activation() != Activation::kRelu) return false;
  return std::all_of(row.begin(), row.end(),
                     [&](const AffineEntry& entry) { return is_at_least_0(entry.factor); });
}

AffineMap ReluChain::relu(const AffineMap& rows, const std::vector<AffineMap*>& carried,
                          const std::string& name) {
  Rows taken(width_);
  AffineMap result;
  for (std::size_t i = 0; i < rows.rows.size(); ++i)
    result.rows.push_back({{taken.add(rows.rows[i], rows.shift[i]), {1, 0}}});
  std::vector<AffineMap> rewritten;
  for (const AffineMap* const value : carried) {
    AffineMap map;
    for (std::size_t i = 0; i < value->rows.size(); ++i) {
      const AffineMap::Row& row = value->rows[i];
      const Enclosed& shift = value->shift[i];
      if (row.empty()) {  // a constant
        map.rows.emplace_back();
        map.shift.push_back(shift);
        continue;
      }
      map.shift.emplace_back();
      map.rows.push_back({{taken.add(row, shift), {1, 0}}});
      if (!is_never_negative(row, shift))
        map.rows.back().push_back({taken.add(negated(row), {-shift.value, shift.radius}), {-1, 0}});
    }
    rewritten.push_back(std::move(map));
  }
  append(taken.map, Activation::kRelu, name);
  result.inputs = width_;
  result.shift.assign(result.rows.size(), {});
  for (std::size_t k = 0; k < carried.size(); ++k) {
    rewritten[k].inputs = width_;
    for (AffineMap::Row& row : rewritten[k].rows)
      std::sort(row.begin(), row.end(),
                [](const AffineEntry& a, const AffineEntry& b) { return a.column < b.column; });
    *carried[k] = std::move(rewritten[k]);
  }
  return result;
}

AffineMap ReluChain::activated(const AffineMap& rows, Activation activation,
                               const std::vector<AffineMap*>& carried, const std::string& name) {
  const int own = rows.outputs();
  Rows kept(width_);
  std::vector<AffineMap> rewritten;
  for (const AffineMap* const value : carried) {
    AffineMap map;
    for (std::size_t i = 0; i < value->rows.size(); ++i) {
      const bool is_constant = value->rows[i].empty();
      map.shift.push_back(is_constant ? value->shift[i] : Enclosed{});
      map.rows.emplace_back();
      if (!is_constant) map.rows.back() = {{own + kept.add(value->rows[i], value->shift[i]), {1, 0}}};
    }
    rewritten.push_back(std::move(map));
  }
  append(stacked({&rows, &kept.map}), activation, name);
  layers_.back().kept = kept.map.outputs();
  for (std::size_t k = 0; k < carried.size(); ++k) {
    rewritten[k].inputs = width_;
    *carried[k] = std::move(rewritten[k]);
  }
  std::vector<int> which(static_cast<std::size_t>(own));
  std::iota(which.begin(), which.end(), 0);
  return selected(identity_map(width_), which);
}

void ReluChain::append(const AffineMap& map, Activation activation, const std::string& name) {
  const std::uint64_t size = static_cast<std::uint64_t>(map.outputs()) * static_cast<std::uint64_t>(width_);
  if (size > kMostElements - elements_)
    throw FoldingLimit{"the network as a chain of dense layers has more than 2^25 numbers"};
  elements_ += size;
  Layer layer;
  layer.name = name;
  layer.activation = activation;
  layer.inputs = width_;
  layer.outputs = map.outputs();
  layer.weights.assign(size, 0.0);
  std::vector<double> weight_radii, bias_radii;
  for (std::size_t i = 0; i < map.rows.size(); ++i) {
    double* const row = layer.weights.data() + i * static_cast<std::size_t>(width_);
    for (const AffineEntry& entry : map.rows[i]) {
      row[entry.column] = entry.factor.value;
      if (entry.factor.radius > 0) weight_radii.push_back(entry.factor.radius);
    }
    layer.biases.push_back(map.shift[i].value);
    if (map.shift[i].radius > 0) bias_radii.push_back(map.shift[i].radius);
  }
  layer.weight_rounding = norm_up(weight_radii);
  layer.bias_rounding = norm_up(bias_radii);
  width_ = layer.outputs;
  layers_.push_back(std::move(layer));
}

std::vector<Layer> ReluChain::finished(const AffineMap& output, const std::string& name) {
  append(output, Activation::kRelu, name);
  return std::move(layers_);
}

AffineMap map_of(const Layer& layer) {
  AffineMap map;
  map.inputs = layer.inputs;
  for (int i = 0; i < layer.outputs; ++i) {
    AffineMap::Row row;
    for (int j = 0; j < layer.inputs; ++j) {
      const double weight =
          layer.weights[static_cast<std::size_t>(i) * static_cast<std::size_t>(layer.inputs) +
                        static_cast<std::size_t>(j)];
      if (weight != 0) row.push_back({j, {weight, 0}});
    }
    map.rows.push_back(std::move(row));
    map.shift.push_back({layer.biases[static_cast<std::size_t>(i)], 0});
  }
  return map;
}

Precision least_precision(const std::vector<Layer>& layers) {
  const auto is_float = [](double number) {
    return std::fabs(number) <= 0x1.fffffep127 && static_cast<double>(static_cast<float>(number)) == number;
  };
  const auto are_floats = [&](const std::vector<double>& numbers) {
    return std::all_of(numbers.begin(), numbers.end(), is_float);
  };
  for (const Layer& layer : layers)
    if (layer.weight_rounding > 0 || layer.bias_rounding > 0 || !are_floats(layer.weights) ||
        !are_floats(layer.biases))
      return Precision::kFloat64;
  return Precision::kFloat32;
}

}  // namespace swarmcert::files
