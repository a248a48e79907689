#include "analysis/firmware/match_code.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>

#include "analysis/firmware/cortex_m.h"
#include "analysis/firmware/elf_image.h"
#include "analysis/firmware/float_blocks.h"
#include "analysis/firmware/golden_vectors.h"
#include "nn/base/input_error.h"
#include "nn/weights/compositions.h"

namespace swarmcert::firmware {
namespace {

/// swarmcert_network::predict_force_z(int, const float*, const swarmcert::nn::Neighbour<float>*, int, float*)
constexpr char kPredict[] = "_ZN17swarmcert_network15predict_force_zEiPKfPKN9swarmcert2nn9NeighbourIfEEiPf";

std::string words_of(const std::vector<std::uint32_t>& words) {
  std::string bytes(4 * words.size(), '\0');
  std::memcpy(bytes.data(), words.data(), bytes.size());
  return bytes;
}

void load(CortexM& target, const ElfImage& image) {
  for (const Segment& segment : image.segments) {
    // The stack and arguments of the calls must not overlap the program's own memory.
    if (segment.address < CortexM::kRam + CortexM::kRamSize + 32 * 1024 &&
        std::uint64_t{segment.address} + segment.bytes_in_use > CortexM::kRam + CortexM::kRamSize &&
        segment.address >= CortexM::kRam)
      throw NotRun("the program takes more RAM than an STM32F405 has");
    if (!segment.bytes.empty()) target.write(segment.address, segment.bytes);
  }
}

/// Addresses from kArguments on: own state, force, neighbours {pointer, kind} and their inputs.
struct Arguments {
  std::uint32_t own = CortexM::kArguments, force = 0, neighbours = 0;
  std::vector<std::uint32_t> words;

  explicit Arguments(const GoldenVector& vector) {
    for (const float x : vector.own) words.push_back(float_bits(x));
    force = next();
    words.push_back(float_bits(-1.0f));  // detects a result that is not written
    neighbours = next();
    const auto count = static_cast<std::uint32_t>(vector.inputs.size());
    std::uint32_t input = neighbours + 8 * count;
    for (std::size_t j = 0; j < vector.inputs.size(); ++j) {
      words.push_back(input);
      words.push_back(static_cast<std::uint32_t>(vector.kinds[j]));
      input += 4 * static_cast<std::uint32_t>(vector.inputs[j].size());
    }
    for (const std::vector<float>& one : vector.inputs)
      for (const float x : one) words.push_back(float_bits(x));
    if (4 * words.size() > CortexM::kArgumentsSize) throw NotRun("the inputs of a call are too many");
  }

 private:
  std::uint32_t next() const { return CortexM::kArguments + 4 * static_cast<std::uint32_t>(words.size()); }
};

CodeMatch run(const std::vector<GoldenVector>& vectors, const ElfImage& image, std::uint32_t function) {
  CortexM target;
  load(target, image);
  CodeMatch result;
  for (const GoldenVector& vector : vectors) {
    const Arguments arguments(vector);
    target.write(CortexM::kArguments, words_of(arguments.words));
    const auto status = target.call(function,
                                    {static_cast<std::uint32_t>(vector.own_kind), arguments.own,
                                     arguments.neighbours, static_cast<std::uint32_t>(vector.inputs.size())},
                                    arguments.force) &
                        0xffu;
    const std::uint32_t force = target.read_word(arguments.force);
    const std::uint32_t expected = float_bits(vector.force_N);
    ++result.vectors;
    if (status != static_cast<std::uint32_t>(vector.status) || force != expected) {
      float found_N = 0;
      std::memcpy(&found_N, &force, sizeof found_N);
      result.outcome = CodeMatch::Outcome::kDifferent;
      result.difference = fmt::format(
          "predict_force_z gives {:.9g} N (bits {:#010x}, status {}) for golden vector {} with {} "
          "neighbours, the network gives {:.9g} N (bits {:#010x}, status {})",
          found_N, force, status, result.vectors - 1, vector.inputs.size(), vector.force_N, expected,
          static_cast<int>(vector.status));
      return result;
    }
  }
  result.outcome = CodeMatch::Outcome::kSame;
  return result;
}

}  // namespace

CodeMatch match_code(const files::Network& network, const std::string& bytes, int most_neighbours) {
  CodeMatch result;
  if (network.plain || files::neighbour_kinds(network).empty()) {
    result.why_not = "swarmcert exports deep sets, and this is another network";
    return result;
  }
  const ElfImage image = read_arm_image(bytes);
  result.why_not = image.why_not;
  if (!result.why_not.empty()) return result;
  const auto found = std::find_if(image.functions.begin(), image.functions.end(),
                                  [](const FunctionSymbol& symbol) { return symbol.name == kPredict; });
  if (found == image.functions.end()) {
    result.why_not =
        "it has no symbol of swarmcert_network::predict_force_z(): link without stripping symbols";
    return result;
  }
  if ((found->address & 1u) == 0) {
    result.why_not = "predict_force_z() is not Thumb code";
    return result;
  }
  const std::vector<GoldenVector> vectors = golden_vectors(network, kVectorsOfMatch, most_neighbours, 1);
  try {
    return run(vectors, image, found->address);
  } catch (const NotRun& error) {
    result.why_not = error.what();
    return result;
  }
}

}  // namespace swarmcert::firmware
