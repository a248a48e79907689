/// @file Internal state of the checker of check.h; its steps are implemented in several files.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "lipschitz/checker/canonical_network.h"
#include "lipschitz/checker/certificate_text.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/dyadic.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/checker/values.h"
#include "nn/weights/functions.h"

namespace swarmcert::check {

class CertificateChecker {
 public:
  explicit CertificateChecker(const files::Json& certificate)
      : certificate_(certificate),
        network_(canonical_network(certificate.at("network"))),
        parts_(files::parts(network_)) {}
  CheckResult run();

 private:
  using Json = files::Json;
  using Row = std::vector<double>;
  using Neighbours = std::map<std::string, long>;  ///< number of neighbours by kind
  static constexpr long kMostNeighbours = 1000000;

  // check.cpp
  void check_weights(const Json& named);
  /// Requires null, or for each named network one interval per input, whether or not a bound uses it.
  void check_boxes(const Json& boxes) const;
  /// Requires that the operations stated for `part` are those of NET, in order.
  void check_chain(const Json& stated, const files::FunctionId& part) const;
  /// Checks only the format of the recorded comparison with samples, because the samples are not available here.
  static void check_samples(const Json& samples, const std::string& where);
  void check_layer(const Json& entry, const files::FunctionId& part, const files::Layer& layer);
  void check_bound(const Json& bound);
  /// Verifies a bound by the product of the norms and of the steepest activation slopes; for local_product, by the
  /// slopes on the box.
  void check_product(const Json& bound, const std::vector<files::FunctionId>& names, double upper,
                     const std::vector<double>& scale, const std::string& where) const;
  /// Requires that functions with activations other than ReLU have no bound proved by parts of a box, and functions
  /// with layers that sort only product bounds.
  void check_activations(const Json& bound, const std::vector<files::FunctionId>& names,
                         const std::string& where) const;
  /// Returns the box on which the activation slopes of a bound are taken: the inputs of `part` after the clamp.
  Intervals local_inputs(const Json& bound, const files::FunctionId& part, const std::string& where) const;
  /// Returns the largest number of neighbours of each kind for a set function; empty: any number.
  Neighbours neighbours_of(const Json& bound, const std::string& where) const;
  static std::string key(const files::FunctionId& function, const std::string& block,
                         const Neighbours& neighbours);
  /// Verifies a law. Several terms of the sum move, one after the other; by the triangle inequality each contributes
  /// its one_neighbour bound. Laws for single coordinates are refused, because the ground and a neighbour have
  /// different coordinates.
  void check_law(const Json& law);

  // check_local.cpp
  /// Reads the box of a part and applies the input clamp, if there is one.
  void read_box(const files::FunctionId& part, std::vector<double>& lower, std::vector<double>& upper,
                const std::string& where) const;
  /// Verifies the contribution of the other terms of the sum to the values before the first ReLU of rho: the range of
  /// each kind's term over its box, proved by a tree, for any number of neighbours of the kind up to its count; the
  /// ground's term once.
  void check_others(const Json& others, const std::vector<files::FunctionId>& names, Neighbours counts,
                    Row& least, Row& most, const std::string& where) const;
  /// Verifies that sqrt(rho) <= `upper` bounds the slope on the box after the input clamp. For a set function, rho is
  /// replaced by a quadratic form; with a stated number of neighbours, by a form that holds for the sums they reach.
  /// For all inputs, the boxes are a projective cover.
  void check_local(const Json& bound, double upper, const std::vector<double>& scale,
                   const std::string& where);
  /// Returns a verified Q with |rho(v) - rho(w)|^2 <= (v - w)' Q (v - w). Its lower triangle is given row by row.
  Matrix checked_form(const Json& form, const files::FunctionId& rho, const std::string& where) const;

  // check_values.cpp
  /// Verifies range, jump and float32 error over a box, layer by layer.
  void check_values(const Json& entry);
  /// Verifies |f - f'| <= jump when a neighbour enters or leaves, from the bound of rho and the range of the
  /// neighbour's term; and |f| <= jump for compositions next to one in which the network is silent.
  void check_jump(const Json& entry, const Bounded& moved, const std::vector<files::FunctionId>& names,
                  const std::string& where) const;
  /// Verifies the errors stated of a float32 evaluation, from those of `output` and of the inputs of its network.
  void check_float32_error(const Json& entry, const Bounded& output,
                           const std::array<std::vector<Dyadic>, 2>& input_error,
                           const std::string& where) const;
  /// Returns a verified Lipschitz bound over all inputs of what follows the input clamp of `part`.
  Dyadic unclamped_slope(const files::FunctionId& part) const;
  /// Returns the box of an entry as the input of the first layer of `part`.
  Intervals values_box(const Json& entry, const files::FunctionId& part, const std::string& where) const;
  /// The same with the errors of the inputs.
  Bounded values_input(const Json& entry, const files::FunctionId& part, const std::string& where) const;

  // check_lower.cpp
  /// Verifies |f(x) - f(y)| >= lower |x - y|. In a set function one neighbour moves from x to y, the others stay.
  void check_lower(const Json& bound, double lower, const std::vector<double>& scale,
                   const std::string& where) const;

  const Json& certificate_;
  const files::Network network_;
  files::Parts parts_;
  std::map<files::FunctionId, std::vector<Dyadic>> norms_;  ///< verified norms of the layers, by network
  std::map<std::string, Dyadic> proved_;                    ///< verified upper bounds, by key()
  std::set<std::string> local_;  ///< keys of the verified bounds that hold on the box only
  int spectral_norms_ = 0, upper_bounds_ = 0, lower_bounds_ = 0, on_boxes_ = 0, values_ = 0;
};

}  // namespace swarmcert::check
