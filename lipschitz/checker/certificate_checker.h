/// @file Internal state of the checker of check.h; its steps fill several files.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "lipschitz/checker/certificate_text.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/dyadic.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/checker/values.h"
#include "nn/weights/functions.h"

namespace swarmcert::check {

class CertificateChecker {
 public:
  CertificateChecker(const files::Json& certificate, const files::Network& network)
      : certificate_(certificate),
        network_(certificate.at("network").at("as") == "float32" ? files::as_float32(network) : network),
        parts_(files::parts(network_)) {}
  CheckResult run();

 private:
  using Json = files::Json;
  using Row = std::vector<double>;
  using Neighbours = std::map<std::string, long>;  ///< by kind
  static constexpr long kMostNeighbours = 1000000;

  // check.cpp
  void check_weights(const Json& named);
  /// Null, or of each network named an interval for every input, whether a bound uses it or not.
  void check_boxes(const Json& boxes) const;
  /// The operations that `part` of NET consists of, in order.
  void check_chain(const Json& stated, const files::FunctionId& part) const;
  /// What was recorded of the comparison with samples: its form only, because the samples are not here.
  static void check_samples(const Json& samples, const std::string& where);
  void check_layer(const Json& entry, const files::FunctionId& part, const files::Layer& layer);
  void check_bound(const Json& bound);
  /// By the product of the norms and of the activations' steepest slopes; local_product: those on the box.
  void check_product(const Json& bound, const std::vector<files::FunctionId>& names, double upper,
                     const std::vector<double>& scale, const std::string& where) const;
  /// What is stated of functions with other activations than ReLU: nothing by parts of a box.
  void check_activations(const Json& bound, const std::vector<files::FunctionId>& names,
                         const std::string& where) const;
  /// Of functions of rotation invariants: nothing on a box, no witness, no scale.
  void check_invariants(const Json& bound, const files::FunctionId& function, const std::string& where) const;
  /// The box that the slopes of a bound are taken on: of the inputs of `part`, as they leave the clamp. Refuses
  /// networks of rotation invariants.
  Intervals local_inputs(const Json& bound, const files::FunctionId& part, const std::string& where) const;
  /// Of a set function, at most how many of each kind there are; empty: any number.
  Neighbours neighbours_of(const Json& bound, const std::string& where) const;
  static std::string key(const files::FunctionId& function, const std::string& block,
                         const Neighbours& neighbours);
  /// Several terms of the sum move: by the triangle inequality one after the other, each by its one_neighbour bound.
  /// Not by single coordinates: those of the ground are others than those of a neighbour.
  void check_law(const Json& law);

  // check_local.cpp
  /// The part's box, or what the input clamp makes of it.
  void read_box(const files::FunctionId& part, std::vector<double>& lower, std::vector<double>& upper,
                const std::string& where) const;
  /// What the other terms of the sum add to the values before the first ReLU of rho: each kind's range over its box,
  /// shown by a tree, as often as there are such neighbours or less; the ground's once.
  void check_others(const Json& others, const std::vector<files::FunctionId>& names, Neighbours counts,
                    Row& least, Row& most, const std::string& where) const;
  /// sqrt(rho) <= `upper` bounds the slope on the box, or on what the input clamp makes of it; of a set function
  /// through a quadratic form of rho, for so many neighbours one that holds for the sums that they reach. Everywhere:
  /// by a projective cover.
  void check_local(const Json& bound, double upper, const std::vector<double>& scale,
                   const std::string& where);
  /// Q with |rho(v) - rho(w)|^2 <= (v - w)' Q (v - w), its lower triangle given row by row.
  Matrix checked_form(const Json& form, const files::FunctionId& rho, const std::string& where) const;

  // check_values.cpp
  /// Range, jump and float32 error over a box, layer by layer.
  void check_values(const Json& entry);
  /// |f - f'| <= jump where a neighbour comes or goes, from the bound of rho and the range of the neighbour's term; and
  /// |f| <= jump beside compositions in which the network is silent.
  void check_jump(const Json& entry, const Bounded& moved, const std::vector<files::FunctionId>& names,
                  const std::string& where) const;
  /// The box of an entry, as the first layer of `part` sees it.
  Intervals values_box(const Json& entry, const files::FunctionId& part, const std::string& where) const;
  /// The same with the errors of the inputs.
  Bounded values_input(const Json& entry, const files::FunctionId& part, const std::string& where) const;

  // check_lower.cpp
  /// |f(x) - f(y)| >= lower |x - y|. In a set function one neighbour moves from x to y, the others stay.
  void check_lower(const Json& bound, double lower, const std::vector<double>& scale,
                   const std::string& where) const;

  const Json& certificate_;
  const files::Network network_;
  files::Parts parts_;
  std::map<files::FunctionId, Dyadic> norms_;  ///< product of the verified norms, by network
  std::map<std::string, Dyadic> proved_;       ///< verified upper bounds, by key()
  std::set<std::string> local_;                ///< those of them that hold on the box only
  int spectral_norms_ = 0, upper_bounds_ = 0, lower_bounds_ = 0, on_boxes_ = 0, values_ = 0;
};

}  // namespace swarmcert::check
