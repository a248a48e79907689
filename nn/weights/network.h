/// @file NET of the command line: one plain network, or a deep set with its kinds of vehicles, units and input clamp.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nn/weights/function_id.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

/// What the networks were declared to satisfy: `gamma = { value, scope, mode }`.
struct GammaStatement {
  enum class Scope { kLayer, kNetwork };
  enum class Mode { kClip, kEqual };
  double value = 0;  ///< spectral norm per layer, or product of the norms over a network's layers
  Scope scope = Scope::kLayer;
  Mode mode = Mode::kClip;  ///< kClip: at most `value`; kEqual: equal to it up to the stored precision
};

/// What phi sees of a neighbour, the inputs or their invariants, is clamped to [lower, upper] before; part of the
/// function. The ground's phi, which sees the vehicle's own state, has no clamp.
struct InputClamp {
  std::vector<double> lower, upper;
};

/// Inputs of the phi of kind "ground": the vehicle's own -z and -v.
inline constexpr int kGroundInputs = 4;

/// NET. Either `plain` is set, or `phi` and `rho` hold at least one kind each.
///
/// Deep set of a vehicle of kind r with neighbours x_1..x_n of kinds c_1..c_n:
///   f(x) = rho_r(phi_ground(own) + sum_j phi_{c_j}(x_j)),
/// where the ground term is present iff phi has the kind "ground", or 0 where `silent` lists r among these neighbours
/// (compositions.h). With `invariants`, J(x_j) stands in place of x_j and K(own) in place of own (nn/invariants.h): see
/// invariants.h.
/// Class invariant after load: every phi but "ground" has the same number of inputs, which is the length of
/// `input_order`, unless there are invariants, and of the clamp where they are given; "ground" has kGroundInputs; all
/// phi have the same number of outputs, which is every rho's number of inputs; all rho have the same number of outputs,
/// components(output_quantity) where that is stated. With invariants: phi has kNeighbourInvariants inputs and "ground"
/// kOwnInvariants, `input_order` is the state that they are made from, and the output a vertical force.
struct Network {
  std::string path;    ///< of network.toml; empty where weight files were named directly
  std::string sha256;  ///< of network.toml; empty likewise
  std::optional<Weights> plain;
  std::map<std::string, Weights> phi;  ///< by the neighbour's kind
  std::map<std::string, Weights> rho;  ///< by the vehicle's own kind

  std::string output_quantity;           ///< "force_z", "force" or "torque"; empty if not stated
  std::string output_unit;               ///< "gf" or "N", of torques "mN_m" or "N_m"; empty if not stated
  std::vector<std::string> input_order;  ///< "dp_x_m", ...; empty if not stated
  bool invariants = false;               ///< `invariants = "rotation"`
  std::optional<InputClamp> clamp;
  std::optional<GammaStatement> gamma;
  /// `silent`, by the vehicle's own kind: the kinds of its neighbours, in order of names, among which f is 0.
  std::map<std::string, std::set<std::vector<std::string>>> silent;
};

/// Numbers that a quantity has: one for "force_z", the vertical force; three for "force" and "torque", along the axes
/// of the world, as the inputs are. 0 where it is empty.
int components(const std::string& quantity);

/// @throws InputError if the network states another output than the vertical force, which is what flight code takes.
void require_force_z(const Network& network);
/// @throws InputError unless the network states a torque.
void require_torque(const Network& network);

/// Which files make up NET: exactly one of `file`, or `phi` with `rho`.
struct NetworkArguments {
  std::string file;      ///< network.toml or one plain weight file
  std::string phi, rho;  ///< weight files; their kind is "default"
  std::string key;       ///< see load_weights(); holds for every weight file
  /// Orders of layers as load_weights() takes them: of `file`, where that is one plain weight file, of `phi` and `rho`.
  std::vector<std::string> order = {}, phi_order = {}, rho_order = {};
  std::string activation =
      {};  ///< names, for the layers of every weight file: see with_activation(); empty: not stated
};

/// @throws InputError that names the part, if a part of NET has another activation than ReLU; `what` says what is for
///   ReLU networks only.
void require_relu(const Network& network, const std::string& what);

/// Whether every network that `function` passes through has ReLU (functions.h).
/// @throws std::out_of_range if NET has no such part.
bool is_relu(const Network& network, const FunctionId& function);

/// with_activation() of every part (activation.h).
Network with_activation(Network network, const std::string& activation);

/// load_network() of networks with any activation, with invariants, and silent in some compositions. What evaluates,
/// exports or searches a network is for ReLU and for relative states: call load_network() there.
Network load_any_network(const NetworkArguments& arguments);

/// What the evaluator runs (nn/deep_set.h): ReLU networks, of relative states or invariants, silent or not.
/// @throws as load_any_network() and require_relu().
Network load_evaluated_network(const NetworkArguments& arguments);

/// Loads NET, whose activation must be ReLU, and whose inputs relative states; it may be silent. A `file` is a
/// network.toml if its name ends in ".toml" or its text names that schema. Weight files named in a network.toml are
/// relative to its folder, which also states the order of their layers.
/// @throws InputError with line, field, value and hint; unknown keys are errors that suggest a known one. Throws what
///   require_relu() and require_relative_states() throw as well.
Network load_network(const NetworkArguments& arguments);

/// as_float32() of every part.
Network as_float32(Network network);

/// Reads the weight file at a path; `order` as in load_weights().
using WeightsLoader = std::function<Weights(const std::string& path, const std::vector<std::string>& order)>;

/// A network.toml from memory, with any activation: `path` gives its folder and the name in messages, `load` reads the
/// weight files.
/// @throws InputError as load_network().
Network parse_network(const std::string& text, const std::string& path, const WeightsLoader& load);

}  // namespace swarmcert::files
