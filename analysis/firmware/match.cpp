#include "analysis/firmware/match.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>

#include "nn/dense_layer.h"
#include "nn/weights/functions.h"

namespace swarmcert::firmware {
namespace {

using Bits = std::vector<std::uint32_t>;

Bits bits_of(const std::vector<double>& values) {
  Bits bits;
  for (const double value : values) bits.push_back(float_bits(static_cast<float>(value)));
  return bits;
}

float float_of(std::uint32_t bits) {
  float value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

Bits reordered(const Bits& matrix, const Order& order) {
  Bits result;
  result.reserve(matrix.size());
  for (const std::size_t i : order) result.push_back(matrix[i]);
  return result;
}

struct Place {
  const FloatBlock* block = nullptr;
  std::size_t begin = 0;
  std::size_t equal = 0;  ///< number of equal entries
};

/// Returns the position in `block` where most numbers agree with `expected`. For speed it tries only positions where
/// one of a few nonzero numbers, spread over the array, agrees; if these are all zero, it tries every position.
Place best_place(const Bits& expected, const FloatBlock& block) {
  Place best;
  const std::size_t size = expected.size();
  if (block.bits.size() < size) return best;
  constexpr std::size_t kProbes = 16;
  bool has_telling_probe = false;
  for (std::size_t p = 0; p < kProbes; ++p) has_telling_probe |= expected[p * size / kProbes] != 0;
  for (std::size_t begin = 0; begin + size <= block.bits.size(); ++begin) {
    bool is_candidate = false;
    for (std::size_t p = 0; p < kProbes && !is_candidate; ++p) {
      const std::size_t i = p * size / kProbes;
      is_candidate = expected[i] == block.bits[begin + i] && (expected[i] != 0 || !has_telling_probe);
    }
    if (!is_candidate && block.bits.size() != size) continue;
    std::size_t equal = 0;
    for (std::size_t i = 0; i < size; ++i) equal += expected[i] == block.bits[begin + i];
    if (best.block == nullptr || equal > best.equal) best = {&block, begin, equal};
    if (equal == size) break;
  }
  return best;
}

Place best_place(const Bits& expected, const std::vector<FloatBlock>& blocks) {
  Place best;
  for (const FloatBlock& block : blocks) {
    const Place place = best_place(expected, block);
    if (place.block != nullptr && (best.block == nullptr || place.equal > best.equal)) best = place;
    if (best.equal == expected.size()) break;
  }
  return best;
}

/// Padding in numbers that a linker may insert between a matrix and its bias.
constexpr std::size_t kPadding = 16;
/// This many equal consecutive numbers are no coincidence.
constexpr std::size_t kTelling = 4;

/// Finds the bias that belongs to a matrix found at `matrix`.
Place bias_place(const Bits& expected, const Place& matrix, std::size_t matrix_size,
                 const std::vector<FloatBlock>& blocks) {
  const auto at = [&](const FloatBlock& block, std::size_t begin) {
    Place place = {&block, begin, 0};
    for (std::size_t i = 0; i < expected.size(); ++i) place.equal += expected[i] == block.bits[begin + i];
    return place;
  };
  std::string name = matrix.block->name;
  const std::size_t word = name.rfind("weight");
  if (word != std::string::npos) {
    name.replace(word, 6, "bias");
    for (const FloatBlock& block : blocks) {
      if (block.name == name && block.bits.size() >= expected.size()) return at(block, 0);
    }
  }
  Place best;
  const std::size_t behind = matrix.begin + matrix_size;
  for (std::size_t begin = behind; begin <= behind + kPadding; ++begin) {
    if (begin + expected.size() > matrix.block->bits.size()) break;
    const Place place = at(*matrix.block, begin);
    if (best.block == nullptr || place.equal > best.equal) best = place;
  }
  if (best.equal == expected.size() || expected.size() < kTelling) return best;
  const Place elsewhere = best_place(expected, blocks);
  return elsewhere.block != nullptr && elsewhere.equal > best.equal ? elsewhere : best;
}

Difference first_difference(const Bits& expected, const Place& place) {
  std::size_t i = 0;
  while (expected[i] == place.block->bits[place.begin + i]) ++i;
  Difference difference;
  difference.entry = std::to_string(i);
  difference.expected = float_of(expected[i]);
  difference.found = float_of(place.block->bits[place.begin + i]);
  difference.name = place.block->name;
  difference.place = place.block->place(place.begin + i);
  return difference;
}

/// If fewer than half of the numbers agree, this is not a modified copy of the array but something else.
bool resembles(const Place& place, const Bits& expected) {
  return place.block != nullptr && 2 * place.equal >= expected.size();
}

}  // namespace

std::vector<Order> orders(const files::Layer& layer) {
  const auto rows = static_cast<std::size_t>(layer.outputs), columns = static_cast<std::size_t>(layer.inputs);
  std::vector<Order> result(3);
  for (std::size_t i = 0; i < rows * columns; ++i) result[0].push_back(i);
  for (std::size_t j = 0; j < columns; ++j) {
    for (std::size_t i = 0; i < rows; ++i) result[1].push_back(i * columns + j);
  }
  result[2].resize(rows * columns);
  nn::to_blocks(result[0].data(), layer.outputs, layer.inputs, result[2].data());
  return result;
}

MatchResult match(const files::Network& network, const std::vector<FloatBlock>& blocks) {
  MatchResult result;
  const auto note = [&](const files::FunctionId& part, const std::string& layer, Difference difference) {
    if (result.first_difference) return;
    difference.part = part.name();
    difference.layer = layer;
    result.first_difference = std::move(difference);
  };
  for (const auto& [part, weights] : files::parts(network)) {
    for (const files::Layer& layer : weights->layers) {
      result.arrays += 2;
      result.numbers += layer.weights.size() + layer.biases.size();
      const Bits rows = bits_of(layer.weights);
      Place matrix;
      Order order;
      for (const Order& candidate : orders(layer)) {
        const Place place = best_place(reordered(rows, candidate), blocks);
        if (order.empty() || place.equal > matrix.equal) matrix = place, order = candidate;
        if (matrix.equal == rows.size()) break;
      }
      const Bits expected = reordered(rows, order);
      if (!resembles(matrix, expected)) {
        Difference difference;
        difference.entry = "weight";
        difference.expected = float_of(rows.front());
        note(part, layer.name, difference);
        continue;
      }
      if (matrix.equal < expected.size()) {
        Difference difference = first_difference(expected, matrix);
        const std::size_t i = order[std::stoul(difference.entry)];
        const auto columns = static_cast<std::size_t>(layer.inputs);
        difference.entry = fmt::format("weight[{}][{}]", i / columns, i % columns);
        note(part, layer.name, difference);
        continue;
      }
      const Bits biases = bits_of(layer.biases);
      const Place bias = bias_place(biases, matrix, rows.size(), blocks);
      if (bias.block == nullptr) {
        Difference difference;
        difference.entry = "bias";
        difference.expected = float_of(biases.front());
        note(part, layer.name, difference);
      } else if (bias.equal < biases.size()) {
        Difference difference = first_difference(biases, bias);
        difference.entry = "bias[" + difference.entry + "]";
        note(part, layer.name, difference);
      }
    }
  }
  return result;
}

}  // namespace swarmcert::firmware
