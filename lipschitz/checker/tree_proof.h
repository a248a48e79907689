/// @file Proofs of Lipschitz bounds and ranges on a box, part by part.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/box_states.h"
#include "lipschitz/checker/dyadic.h"

namespace swarmcert::check {

/// A function given by its hidden layers and by a bound |df|^2 <= dh' G dh on the function behind them. Only the moving
/// coordinates of x change, and |dx|^2 is sum (dx_k / weight_k)^2.
struct LocalFunction {
  std::vector<HiddenLayer> hidden;
  Matrix gram;                   ///< exact G for the last hidden layer; no rows: given by the forms of a tree
  std::vector<int> coordinates;  ///< moving coordinates, ascending
  std::vector<double> weight;    ///< one per moving coordinate, positive
  /// For a set function, the layers behind phi's hidden layers: phi's last layer v = W h + b, which has no ReLU, and
  /// rho's hidden layers. Empty: there are no forms.
  std::vector<HiddenLayer> behind = {};
  Matrix behind_gram;  ///< exact G for the last hidden layer of rho

  LocalFunction() : gram(0, 0), behind_gram(0, 0) {}
};

/// Two neurons, numbered over all outputs of hidden layers, that cannot be in these states at once: s_1 y_1 and s_2 y_2
/// are nowhere in the part both positive, with s = 1 for on and s = -1 for off, because
/// lambda s_1 y_1 + (1 - lambda) s_2 y_2 <= 0 there. Hence u_1 u_2 = 0 at almost every point, with u = dz for on and
/// u = dy - dz for off. `multiplier`, which may have either sign, multiplies 2 u_1 u_2.
struct Conflict {
  std::size_t first = 0, second = 0;
  bool first_on = true, second_on = true;
  double lambda = 0;  ///< in [0, 1]
  double multiplier = 0;
};

/// A bound |drho|^2 <= dv' Q dv on rho that holds in a part, with the states of rho's neurons that the part decides.
struct Form {
  std::vector<double> q;  ///< the lower triangle, row by row
  std::vector<double> t;  ///< one nonnegative number per output of a hidden layer of rho
};

/// A proof as a tree of words in preorder. The words for the current box are:
/// - "s3": coordinate 3 is halved; the tree of the lower half follows, then that of the upper half;
/// - "t5": a leaf, proved by multipliers 5.
/// The following words may precede "s" or "t":
/// - "d17+5" or "d17-5": neuron 17 is on or off in the whole box, proved by the slopes of corner 5 (Decision);
///   decisions of neurons of phi come first, those of neurons of rho directly before "q" or "r";
/// - "q2": form 2 holds in the box;
/// - "r": rho's neurons are bounded in the box, as they are before a form.
/// Decided neurons remain decided in both halves. The trees of several boxes follow one another.
struct TreeProof {
  std::string tree;
  /// Each has one nonnegative number per output of a hidden layer; the numbers of outputs without ReLU are not used.
  std::vector<std::vector<double>> multipliers;
  /// One list of conflicts per entry of `multipliers`, or empty. A conflict is ignored in a part that decides one of
  /// its two neurons or where lambda does not prove it.
  std::vector<std::vector<Conflict>> conflicts = {};
  std::vector<Form> forms = {};
};

struct TreeVerdict {
  bool holds = false;
  std::string reason;  ///< what fails, and where in the tree
  long leaves = 0;
};

/// Returns whether the tree proves |f(x) - f(y)|^2 <= rho |x - y|^2 for all x, y of the box. The parts cover the box: a
/// split is followed by both halves, which share the cutting plane. The slope of f along a segment is bounded by the
/// slopes in the parts it crosses, so each part may be proved separately.
///
/// Proof for one part. Its neurons have bounds (box_states.h). For the derivatives at almost every point of the part,
/// dz = dy for a neuron whose y stays positive and for an output without ReLU, dz = 0 for a neuron whose y stays
/// negative, and dz (dy - dz) >= 0 otherwise. For two neurons in conflict, u_1 u_2 = 0 with u = dz (on) or dy - dz
/// (off). With multipliers t >= 0 of the undecided neurons, multipliers s of either sign of the conflicts, and
/// everything expressed in dx and the dz of the undecided neurons, the claim follows from
///   S = rho I_x - F' G F - sum_i t_i (a_i e_i' + e_i a_i') - sum_c s_c (p_c q_c' + q_c p_c') >= 0,
/// with a_i = (dy_i in these variables) - e_i; p_c and q_c are e_i (on) or a_i (off) for the two neurons of conflict c.
///
/// A form holds in a part if |drho|^2 <= dv' Q dv for the derivatives there, by the same inequality with Q in place of
/// rho I, over dv and the undecided neurons of rho. Then G = W' Q W in this part and its subtree, until another form
/// replaces it.
///
/// S is computed in double together with a bound on the norm of its round-off error, and scaled to about a unit
/// diagonal by powers of two. The bound, and gamma_(n+1) tr(S) for the error of a Cholesky factorisation in double
/// (Rump 2006, BIT 46), are subtracted from the diagonal. If the factorisation then succeeds, S is positive definite.
TreeVerdict check_tree(const LocalFunction& f, const std::vector<double>& lower,
                       const std::vector<double>& upper, double rho, const TreeProof& proof);
/// The same for several boxes: proves the bound on the slope at almost every point of their union.
TreeVerdict check_tree(const LocalFunction& f, const std::vector<Sides>& boxes, double rho,
                       const TreeProof& proof);

/// Returns whether the tree proves least <= y <= most over the box for the outputs y of the last layer, which has no
/// ReLU. Each leaf is proved by neuron_bounds(). Leaves are "t0", because there are no multipliers.
TreeVerdict check_range(const std::vector<HiddenLayer>& layers, const std::vector<double>& lower,
                        const std::vector<double>& upper, const std::string& tree,
                        const std::vector<double>& least, const std::vector<double>& most);

}  // namespace swarmcert::check
