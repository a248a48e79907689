/// @file NET of the command line: a plain network, or a deep set with its kinds of vehicles, units and input clamp.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/weights/function_id.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

class Keys;

/// The stated limit on the networks' spectral norms: `gamma = { value, scope, mode }`.
struct GammaStatement {
  enum class Scope { kLayer, kNetwork };
  enum class Mode { kClip, kEqual };
  double value = 0;  ///< spectral norm per layer, or product of the norms over a network's layers
  Scope scope = Scope::kLayer;
  Mode mode = Mode::kClip;  ///< kClip: at most `value`; kEqual: equal to it up to the stored precision
};

/// Bounds [lower, upper] to which the input of phi, a neighbour's state, is clamped. The clamp is part of the
/// function. It does not apply to the ground's phi, whose input is the vehicle's own state.
struct InputClamp {
  std::vector<double> lower, upper;
};

/// Number of inputs of the phi of kind "ground": the vehicle's own -z and -v.
inline constexpr int kGroundInputs = 4;

/// What the user stated beside NET about how to read its weight files.
struct ReadingOptions {
  std::string key;  ///< see load_weights(); applies to every weight file
  /// Orders of layers as in load_weights(): of the file, if it is a plain weight file, of `phi` and of `rho`.
  std::vector<std::string> order = {}, phi_order = {}, rho_order = {};
  std::vector<std::string> select = {};  ///< see LayerChoice; of a plain weight file
  std::string activation =
      {};  ///< names, for the layers of every weight file: see with_activation(); empty: not stated
  /// File of VecNormalize for a plain weight file (vec_normalize.h); in Network::options, from the folder of that.
  /// "none": none, even if one lies beside it; empty: the one beside it, if there is one.
  std::string normalization = {};
};

/// Converts options to an object of a certificate, and back.
Json options_json(const ReadingOptions& options);
ReadingOptions options_of(const Json& json);

/// NET. Either `plain` is set, or `phi` and `rho` contain at least one kind each.
///
/// For a vehicle of kind r with neighbours x_1..x_n of kinds c_1..c_n, the deep set is
///   f(x) = rho_r(phi_ground(own) + sum_j phi_{c_j}(x_j)),
/// where the ground term is present iff phi has the kind "ground"; f is 0 if `silent` lists r among these neighbours
/// (compositions.h).
///
/// Class invariant after load:
/// - Every phi but "ground" has the same number of inputs, which is the length of `input_order` and of the clamp,
///   where these are given; "ground" has kGroundInputs.
/// - All phi have the same number of outputs, which is every rho's number of inputs.
/// - All rho have the same number of outputs, which is components(output_quantity) if that is stated.
struct Network {
  std::string path;        ///< of network.toml; empty if weight files were given directly
  std::string sha256;      ///< of network.toml; empty likewise
  ReadingOptions options;  ///< with which the files were read
  std::optional<Weights> plain;
  std::map<std::string, Weights> phi;  ///< keyed by the neighbour's kind
  std::map<std::string, Weights> rho;  ///< keyed by the vehicle's own kind

  std::string output_quantity;           ///< "force_z", "force" or "torque"; empty if not stated
  std::string output_unit;               ///< "gf" or "N"; for torques "mN_m" or "N_m"; empty if not stated
  std::vector<std::string> input_order;  ///< "dp_x_m", ...; empty if not stated
  std::optional<InputClamp> clamp;
  std::optional<GammaStatement> gamma;
  /// `silent`, keyed by the vehicle's own kind: the alphabetically sorted kinds of the neighbours for which f is 0.
  std::map<std::string, std::set<std::vector<std::string>>> silent;
};

/// Returns the number of components of a quantity: one for "force_z", the vertical force; three for "force" and
/// "torque", in world coordinates like the inputs; 0 for an empty string.
int components(const std::string& quantity);

/// @throws InputError if the network states another output than the vertical force, which flight code requires.
void require_force_z(const Network& network);
/// @throws InputError unless the network states a torque.
void require_torque(const Network& network);

/// The files that make up NET: either `file`, or `phi` and `rho`.
struct NetworkArguments : ReadingOptions {
  std::string file;      ///< network.toml or a single plain weight file
  std::string phi, rho;  ///< weight files; their kind is "default"
};

/// @throws InputError that names the part, if a part of NET has an activation other than ReLU; `what` names what
///   supports only ReLU networks.
void require_relu(const Network& network, const std::string& what);

/// Returns whether every network that `function` passes through has only ReLU activations (functions.h).
/// @throws std::out_of_range if NET has no such part.
bool is_relu(const Network& network, const FunctionId& function);

/// Applies with_activation() to every part (activation.h).
Network with_activation(Network network, const std::string& activation);

/// Same as load_network(), but accepts networks with any activation.
Network load_any_network(const NetworkArguments& arguments);

/// Loads NET, which must have ReLU activations, as the evaluator (nn/deep_set.h); it may be silent. A `file` is a
/// network.toml if its name ends in ".toml" or its text names that schema. Paths of weight files in a network.toml are
/// relative to its folder; the file also states the order of their layers.
/// @throws InputError with line, field, value and hint; unknown keys are errors that suggest a known one.
/// @throws as require_relu().
Network load_network(const NetworkArguments& arguments);

/// Applies as_float32() to every part.
Network as_float32(Network network);

/// Reads the weight file at a path; `choice` is as in load_weights().
using WeightsLoader = std::function<Weights(const std::string& path, const LayerChoice& choice)>;

/// Describes network.toml.
void describe_network_file(Keys& keys);

/// Parses a network.toml from memory, with any activation. `path` gives its folder and its name in messages; `load`
/// reads the weight files.
/// @throws InputError as load_network().
Network parse_network(const std::string& text, const std::string& path, const WeightsLoader& load);

}  // namespace swarmcert::files
