/// @file A deep set over neighbours of several kinds, whose output is bitwise independent of the neighbours' order.
///
///   f(own, {x_j, c_j}) = rho(phi_ground(own) + sum_j phi_{c_j}(clamp(x_j)))
///
/// For the compositions of neighbours listed in `silent`, f is 0: the network is switched off where it did not help. f
/// therefore jumps by its full value when a neighbour arrives or leaves and the composition becomes silent or stops
/// being so; while the neighbours stay the same, f is either 0 throughout or the function above.
///
/// Floating-point addition is not associative: summing the same neighbours in another order gives different bits. The
/// order in which radio packets arrive would then be an input of the controller that no certificate covers and no log
/// reproduces. The sum therefore has one canonical order that depends on the set alone: first the ground, then the
/// kinds by index, and within a kind lexicographically by the clamped inputs of phi, compared as unsigned bit patterns.
/// Any total order would do; this one needs no special case for signed zeros. Neighbours that compare equal have equal
/// inputs and are interchangeable. Consecutive neighbours of one kind are passed through phi together, a few at a time;
/// this does not change the order of the additions.
#pragma once

#include <cstdint>

#include "nn/arithmetic.h"
#include "nn/mlp.h"

namespace swarmcert::nn {

/// The caller owns the arrays.
/// Precondition: fits_together(set) and lower <= upper.
template <typename Scalar>
struct DeepSet {
  const Mlp<Scalar>* ground;  ///< input: the vehicle's own state; nullptr: no ground term
  const Mlp<Scalar>* phi;     ///< [num_kinds], indexed by the neighbour's kind
  int num_kinds;
  Mlp<Scalar> rho;      ///< for the vehicle's own kind
  const Scalar* lower;  ///< [inputs()] each; nullptr: no clamp. The input of `ground` is never clamped.
  const Scalar* upper;
  const int* silent = nullptr;  ///< [num_silent x num_kinds]: neighbours per kind where f is 0
  int num_silent = 0;

  /// Number of inputs per neighbour.
  constexpr int inputs() const { return phi[0].inputs(); }
  /// Number of inputs that describe the vehicle's own state; 0 without a ground term.
  constexpr int own_inputs() const { return ground == nullptr ? 0 : ground->inputs(); }
  constexpr int hidden() const { return rho.inputs(); }
  constexpr int outputs() const { return rho.outputs(); }
};

/// Returns true if all networks are chains, all phi have the same number of inputs, and phi and ground have
/// rho.inputs() outputs.
template <typename Scalar>
constexpr bool fits_together(const DeepSet<Scalar>& set) {
  if (set.num_kinds < 1 || !is_chain(set.rho)) return false;
  if (set.ground != nullptr && (!is_chain(*set.ground) || set.ground->outputs() != set.hidden()))
    return false;
  for (int kind = 0; kind < set.num_kinds; ++kind) {
    const Mlp<Scalar>& phi = set.phi[kind];
    if (!is_chain(phi) || phi.inputs() != set.inputs() || phi.outputs() != set.hidden()) return false;
  }
  return true;
}

/// One neighbour as seen by the vehicle.
template <typename Scalar>
struct Neighbour {
  const Scalar* input;  ///< [DeepSet::inputs()]
  int kind;             ///< index into DeepSet::phi
};

/// Result of an evaluation: success or the reason for failure.
enum class DeepSetStatus : std::uint8_t {
  kOk,
  kTooManyNeighbours,  ///< negative, or more than the workspace can hold
  kUnknownKind,
  kInputNotFinite,
  kOutputNotFinite  ///< an internal overflow reached the output
};

/// Memory for one evaluation. The caller owns it; it need not be initialised.
template <typename Scalar>
struct DeepSetWorkspace {
  Scalar* inputs;      ///< [capacity x DeepSet::inputs()], copies of the clamped inputs of phi
  int* order;          ///< [capacity]
  int capacity;        ///< maximum number of neighbours
  Scalar* hidden_sum;  ///< [DeepSet::hidden()]
  Scalar* scratch;     ///< [scratch_size(set)]
};

/// Largest number of neighbours that are passed through phi together.
inline constexpr int kMostTogether = 3;

/// Number of elements that evaluate() needs in DeepSetWorkspace::scratch.
template <typename Scalar>
constexpr int scratch_size(const DeepSet<Scalar>& set) {
  int largest = scratch_size(set.rho);
  if (set.ground != nullptr && scratch_size(*set.ground) > largest) largest = scratch_size(*set.ground);
  for (int kind = 0; kind < set.num_kinds; ++kind) {
    const int size =
        scratch_size(set.phi[kind], kMostTogether) + kMostTogether * (set.inputs() + set.hidden());
    if (size > largest) largest = size;
  }
  return largest;
}

namespace detail {

template <typename Scalar>
inline bool comes_before(const Scalar* a, const Scalar* b, int size) {
  for (int i = 0; i < size; ++i) {
    if (bits(a[i]) != bits(b[i])) return bits(a[i]) < bits(b[i]);
  }
  return false;
}

/// Copies the inputs of phi before they are clamped, so that a position updated by another task between sorting and
/// summation cannot break the order.
/// @returns whether all copied inputs are finite.
template <typename Scalar>
inline bool take_input(const DeepSet<Scalar>& set, const Scalar* input, Scalar* copy) {
  for (int i = 0; i < set.inputs(); ++i) copy[i] = input[i];
  for (int i = 0; i < set.inputs(); ++i) {
    if (!is_finite(copy[i])) return false;
  }
  return true;
}

/// Writes the clamped inputs of phi to `copies`.
template <typename Scalar>
inline DeepSetStatus take_inputs(const DeepSet<Scalar>& set, const Neighbour<Scalar>* neighbours,
                                 int num_neighbours, Scalar* copies) {
  const int size = set.inputs();
  for (int j = 0; j < num_neighbours; ++j) {
    if (neighbours[j].kind < 0 || neighbours[j].kind >= set.num_kinds) return DeepSetStatus::kUnknownKind;
    Scalar* const copy = copies + static_cast<long>(j) * size;
    if (!take_input(set, neighbours[j].input, copy)) return DeepSetStatus::kInputNotFinite;
    for (int i = 0; set.lower != nullptr && i < size; ++i) {
      const Scalar x = copy[i];
      copy[i] = x < set.lower[i] ? set.lower[i] : x > set.upper[i] ? set.upper[i] : x;
    }
  }
  return DeepSetStatus::kOk;
}

/// Returns whether the number of neighbours of each kind equals that of a silent composition.
/// Precondition: all kinds are valid.
template <typename Scalar>
inline bool is_silent(const DeepSet<Scalar>& set, const Neighbour<Scalar>* neighbours, int num_neighbours) {
  for (int s = 0; s < set.num_silent; ++s) {
    const int* const wanted = set.silent + static_cast<long>(s) * set.num_kinds;
    bool is_same = true;
    for (int kind = 0; kind < set.num_kinds && is_same; ++kind) {
      int count = 0;
      for (int j = 0; j < num_neighbours; ++j) count += neighbours[j].kind == kind ? 1 : 0;
      is_same = count == wanted[kind];
    }
    if (is_same) return true;
  }
  return false;
}

/// Sets hidden_sum to phi_ground(own).
/// @returns whether the input of phi_ground is finite.
template <typename Scalar>
inline bool add_ground(const DeepSet<Scalar>& set, const Scalar* own,
                       const DeepSetWorkspace<Scalar>& workspace) {
  for (int i = 0; i < set.ground->inputs(); ++i) {
    if (!is_finite(own[i])) return false;
  }
  evaluate(*set.ground, own, workspace.hidden_sum, workspace.scratch);
  return true;
}

/// Writes the neighbours' indices to `order` in the canonical order defined at the top of this file. Uses insertion
/// sort, which is short, works in place and suits the small number of neighbours.
template <typename Scalar>
inline void sort_canonically(const DeepSet<Scalar>& set, const Neighbour<Scalar>* neighbours,
                             int num_neighbours, const Scalar* copies, int* order) {
  const int size = set.inputs();
  for (int j = 0; j < num_neighbours; ++j) {
    int at = j;
    for (; at > 0; --at) {
      const int other = order[at - 1];
      const int kind = neighbours[j].kind;
      const int other_kind = neighbours[other].kind;
      const bool stays = kind != other_kind ? other_kind < kind
                                            : !comes_before(copies + static_cast<long>(j) * size,
                                                            copies + static_cast<long>(other) * size, size);
      if (stays) break;
      order[at] = other;
    }
    order[at] = j;
  }
}

/// Adds phi of `Together` neighbours of one kind to the sum, in the given order.
/// @param order [Together], indices of the neighbours.
template <int Together, typename Scalar>
inline void add_phi(const DeepSet<Scalar>& set, int kind, const int* order,
                    const DeepSetWorkspace<Scalar>& workspace) {
  const int inputs = set.inputs();
  Scalar* const x = workspace.scratch;
  Scalar* const hidden = x + static_cast<long>(Together) * inputs;
  Scalar* const scratch = hidden + static_cast<long>(Together) * set.hidden();
  for (int c = 0; c < Together; ++c) {
    const Scalar* const own = workspace.inputs + static_cast<long>(order[c]) * inputs;
    for (int j = 0; j < inputs; ++j) x[j * Together + c] = own[j];
  }
  evaluate_together<Together>(set.phi[kind], x, hidden, scratch);
  for (int i = 0; i < set.hidden(); ++i) {
    Scalar sum = workspace.hidden_sum[i];
    for (int c = 0; c < Together; ++c) sum += hidden[i * Together + c];
    workspace.hidden_sum[i] = sum;
  }
}

template <typename Scalar>
inline DeepSetStatus evaluate_checked(const DeepSet<Scalar>& set, const Scalar* own,
                                      const Neighbour<Scalar>* neighbours, int num_neighbours, Scalar* output,
                                      const DeepSetWorkspace<Scalar>& workspace) {
  if (num_neighbours < 0 || num_neighbours > workspace.capacity) return DeepSetStatus::kTooManyNeighbours;
  const DeepSetStatus status = take_inputs(set, neighbours, num_neighbours, workspace.inputs);
  if (status != DeepSetStatus::kOk) return status;
  if (is_silent(set, neighbours, num_neighbours)) {
    for (int i = 0; i < set.outputs(); ++i) output[i] = Scalar(0);
    return DeepSetStatus::kOk;
  }
  sort_canonically(set, neighbours, num_neighbours, workspace.inputs, workspace.order);

  for (int i = 0; i < set.hidden(); ++i) workspace.hidden_sum[i] = Scalar(0);
  if (set.ground != nullptr && !add_ground(set, own, workspace)) return DeepSetStatus::kInputNotFinite;
  for (int begin = 0; begin < num_neighbours;) {
    const int* const order = workspace.order + begin;
    const int kind = neighbours[order[0]].kind;
    int left = 1;
    while (begin + left < num_neighbours && neighbours[order[left]].kind == kind) ++left;
    if (left == 3 || left > 4) {
      add_phi<3>(set, kind, order, workspace), begin += 3;
    } else if (left > 1) {  // for four, two pairs are cheaper than three and one
      add_phi<2>(set, kind, order, workspace), begin += 2;
    } else {
      add_phi<1>(set, kind, order, workspace), begin += 1;
    }
  }
  evaluate(set.rho, workspace.hidden_sum, output, workspace.scratch);
  for (int i = 0; i < set.outputs(); ++i) {
    if (!is_finite(output[i])) return DeepSetStatus::kOutputNotFinite;
  }
  return DeepSetStatus::kOk;
}

}  // namespace detail

/// Evaluates `set`.
/// @param own        [set.own_inputs()]; ignored if there is no ground term.
/// @param neighbours [num_neighbours], in any order; the result is bitwise the same for every order.
/// @param output     [set.outputs()]; all zeros unless the status is kOk: no compensation is better than a wrong one.
template <typename Scalar>
inline DeepSetStatus evaluate(const DeepSet<Scalar>& set, const Scalar* own,
                              const Neighbour<Scalar>* neighbours, int num_neighbours, Scalar* output,
                              const DeepSetWorkspace<Scalar>& workspace) {
  const DeepSetStatus status =
      detail::evaluate_checked(set, own, neighbours, num_neighbours, output, workspace);
  if (status != DeepSetStatus::kOk) {
    for (int i = 0; i < set.outputs(); ++i) output[i] = Scalar(0);
  }
  return status;
}

}  // namespace swarmcert::nn
