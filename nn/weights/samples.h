/// @file Inputs and outputs recorded from a trained network, for comparison with its weight file.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

inline constexpr const char* kSamplesSchema = "swarmcert/samples/1";

/// Samples of one stored network.
struct Samples {
  std::string path;
  std::string sha256;  ///< of the file
  int inputs = 0, outputs = 0;
  std::vector<double> x;   ///< [count x inputs], row-major, finite
  std::vector<double> y;   ///< [count x outputs], row-major, finite
  std::vector<int> lines;  ///< for a CSV file: the line of each sample; otherwise empty

  std::size_t count() const { return inputs == 0 ? 0 : x.size() / static_cast<std::size_t>(inputs); }
  /// Returns "line 7" for a CSV file, else "sample 6", counted from 0 as in Python.
  std::string place(std::size_t i) const;
};

/// Reads samples of the parts of NET, keyed by the name of the part. The format is detected from the content:
/// - CSV: per line the inputs, then the outputs, separated by commas, semicolons, tabs or blanks. The first line may
///   name the columns; lines that begin with # are ignored.
/// - .npz (numpy.savez): arrays `inputs` [count x inputs] and `outputs` [count x outputs], float32 or float64.
/// - JSON: {"inputs": [[...]], "outputs": [[...]]}; for parts {"networks": {"phi:small": {"inputs": ..., ...}}}.
/// @param argument "FILE", or "PART=FILE" for samples of that part. A FILE without a part belongs to the plain network.
/// @throws InputError with line, sample or array if numbers are missing, not finite or do not match the network's
///   inputs and outputs, if NET has no such part, or if the file is empty.
std::map<std::string, Samples> read_samples(const std::string& argument, const Network& network);

/// Same as read_samples(), for one network and from memory: CSV, .npz or JSON without `networks`.
Samples parse_samples(const std::string& bytes, const std::string& path, int inputs, int outputs);

/// Describes a JSON file of samples.
void describe_samples_file(Keys& keys);

/// Returns {"schema": "swarmcert/samples/1", "networks": {...}}, which read_samples() reads.
Json samples_json(const std::map<std::string, Samples>& samples);

/// Agreement between the certified function and the recorded samples.
struct SampleAgreement {
  std::string path, sha256;
  std::size_t count = 0;
  double tolerance = 0;          ///< for every output, in its unit
  double largest_deviation = 0;  ///< at most `tolerance`; evaluated in double, whose rounding is far below it
};

/// A float32 recording differs from exact arithmetic by about 1e-6 of the range of the outputs.
inline constexpr double kSampleTolerance = 1e-5;

/// Evaluates `part` of NET, including its clamp, at every sample and compares the outputs. The tolerance is `relative`
/// times the spread of the recorded outputs (of the output that varies most, or their largest magnitude if none
/// varies), plus 2^-20 of the largest output, 16 units in the last place of float32.
/// @throws InputError if an output differs by more; it shows the worst sample, its inputs, recorded and computed
///   output.
SampleAgreement hold_against(const Network& network, const FunctionId& part, const Samples& samples,
                             double relative = kSampleTolerance);

}  // namespace swarmcert::files
