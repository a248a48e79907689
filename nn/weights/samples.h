/// @file Inputs and outputs recorded from a trained network: what its weight file is held against.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

/// Samples of one stored network.
struct Samples {
  std::string path;
  std::string sha256;  ///< of the file
  int inputs = 0, outputs = 0;
  std::vector<double> x;   ///< [count x inputs], row-major, finite
  std::vector<double> y;   ///< [count x outputs], row-major, finite
  std::vector<int> lines;  ///< of a CSV file: where each sample stands; empty otherwise

  std::size_t count() const { return inputs == 0 ? 0 : x.size() / static_cast<std::size_t>(inputs); }
  /// "line 7" in a CSV file, else "sample 6", counted from 0 as Python does.
  std::string place(std::size_t i) const;
};

/// Reads samples of parts of NET, by name of the part. The format is found from the content:
/// - CSV: per line the inputs, then the outputs, separated by commas, semicolons, tabs or blanks. The first line may
///   name the columns, lines that begin with # are left out.
/// - .npz (numpy.savez): arrays `inputs` [count x inputs] and `outputs` [count x outputs], float32 or float64.
/// - JSON: {"inputs": [[...]], "outputs": [[...]]}; of several parts {"networks": {"phi:small": {"inputs": ..., ...}}}.
/// @param argument "FILE", or "PART=FILE" for samples of that part. A FILE that does not name a part is of the plain
///   network.
/// @throws InputError with line, sample or array for numbers that are missing, not finite or not as many as the
///   network has inputs and outputs, for a part that NET has not, and for an empty file.
std::map<std::string, Samples> read_samples(const std::string& argument, const Network& network);

/// As read_samples(), of one network and from memory. CSV, .npz or JSON without `networks`.
Samples parse_samples(const std::string& bytes, const std::string& path, int inputs, int outputs);

/// {"schema": "swarmcert/samples/1", "networks": {...}}, which read_samples() reads.
Json samples_json(const std::map<std::string, Samples>& samples);

/// How far the function that is certified is from what was recorded.
struct SampleAgreement {
  std::string path, sha256;
  std::size_t count = 0;
  double tolerance = 0;          ///< of every output, in its unit
  double largest_deviation = 0;  ///< at most `tolerance`; evaluated in double, whose rounding is far below it
};

/// A recording in float32 differs from exact arithmetic by some 1e-6 of what the outputs range over.
inline constexpr double kSampleTolerance = 1e-5;

/// Evaluates part `name` of NET, clamp included, at every sample.
/// The tolerance is `relative` times the spread of the recorded outputs (of the one that varies most; its largest
/// magnitude where nothing varies), and 2^-20 of the largest output, 16 units in the last place of float32.
/// @throws InputError with the worst sample, its inputs, recorded and computed output where one differs by more.
SampleAgreement hold_against(const Network& network, const FunctionId& part, const Samples& samples,
                             double relative = kSampleTolerance);

}  // namespace swarmcert::files
