/// @file A Lipschitz bound on a box, proved part by part.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/box_states.h"
#include "lipschitz/checker/dyadic.h"

namespace swarmcert::check {

/// |df|^2 <= dh' G dh in front of what follows the hidden layers, dx in the moving coordinates only and measured as
/// sum (dx_k / weight_k)^2.
struct LocalFunction {
  std::vector<HiddenLayer> hidden;
  Matrix gram;                   ///< G, exactly, of the last hidden layer; no rows: as a tree's forms say
  std::vector<int> coordinates;  ///< that move, ascending
  std::vector<double> weight;    ///< one per moving coordinate, positive
  /// Of a set function, what follows phi's hidden layers: phi's last layer v = W h + b, which has no ReLU, and rho's
  /// hidden layers. None: no forms.
  std::vector<HiddenLayer> behind = {};
  Matrix behind_gram;  ///< exactly, of rho's last hidden layer

  LocalFunction() : gram(0, 0), behind_gram(0, 0) {}
};

/// Two neurons, counted over all outputs of hidden layers, that cannot be in these states at once: nowhere in the part
/// are s_1 y_1 and s_2 y_2 both positive, s = 1 for a neuron that is on and -1 for one that is off, because
/// lambda s_1 y_1 + (1 - lambda) s_2 y_2 <= 0 there. Then u_1 u_2 = 0 at almost every point, with u = dz of a neuron
/// that is on and u = dy - dz of one that is off; `multiplier`, of either sign, multiplies 2 u_1 u_2.
struct Conflict {
  std::size_t first = 0, second = 0;
  bool first_on = true, second_on = true;
  double lambda = 0;  ///< in [0, 1]
  double multiplier = 0;
};

/// |drho|^2 <= dv' Q dv in front of rho, where rho's neurons are as a part decides them.
struct Form {
  std::vector<double> q;  ///< the lower triangle, row by row
  std::vector<double> t;  ///< one number per output of a hidden layer of rho, not negative
};

/// The words of a tree in preorder: "s3" halves coordinate 3 of the box at hand, its lower half first; "t5" is a leaf
/// that multipliers 5 prove. Before what becomes of the box at hand: "q2" says that form 2 holds in it, "r" that rho's
/// neurons are bounded in it, as before a form; "d17+5" that neuron 17 is on all over it, "d17-5" off, as the slopes of
/// corner 5 show (Decision): neurons of phi first of all, those of rho before "q" or "r". What is decided stays so in
/// both halves. Of several boxes, their trees one after the other.
struct TreeProof {
  std::string tree;
  /// Each with one number per output of a hidden layer, not negative; nobody reads those of outputs without ReLU.
  std::vector<std::vector<double>> multipliers;
  /// Conflicts that go with each multipliers, or nothing at all. In a part that decides one of the two neurons, or
  /// where lambda does not show it, a conflict counts for nothing.
  std::vector<std::vector<Conflict>> conflicts = {};
  std::vector<Form> forms = {};
};

struct TreeVerdict {
  bool holds = false;
  std::string reason;  ///< what fails, and where in the tree
  long leaves = 0;
};

/// Whether |f(x) - f(y)|^2 <= rho |x - y|^2 for all x, y of the box, shown by the tree. The parts cover the box: a
/// split is followed by both halves, which share the plane of the cut. The slope of f along a segment is bounded by
/// that of the parts it crosses, so each part may be proved alone.
///
/// A part. Its neurons have bounds (box_states.h). For the derivatives at almost every point of the part, dz = dy for a
/// neuron whose y stays positive, and for an output without ReLU, dz = 0 where it stays negative, and dz (dy - dz) >= 0
/// otherwise. Of two neurons in conflict one has u = 0, with u = dz (on) or dy - dz (off): u_1 u_2 = 0. With
/// multipliers t >= 0 of the undecided, s of either sign of the conflicts, and everything expressed in (dx, dz of the
/// undecided), the claim follows from
///   S = rho I_x - F' G F - sum_i t_i (a_i e_i' + e_i a_i') - sum_c s_c (p_c q_c' + q_c p_c') >= 0,
/// with a_i = (dy_i in these variables) - e_i, and p_c, q_c one of e_i (on) and a_i (off) for the conflict's two
/// neurons.
///
/// A form holds in a part if |drho|^2 <= dv' Q dv for the derivatives there, by the same inequality with Q in place of
/// rho I, over dv and the neurons of rho that the part leaves undecided. G = W' Q W then, in it and in what it is
/// halved into, until another form takes its place.
///
/// S is computed in double together with a bound on the norm of what rounding changed, scaled to a unit diagonal by
/// powers of two, shifted down by that bound and by what a Cholesky factorisation in double may overlook,
/// gamma_(n+1) tr(S) (Rump 2006, BIT 46), and factorised: if that runs to its end, S is positive definite.
TreeVerdict check_tree(const LocalFunction& f, const std::vector<double>& lower,
                       const std::vector<double>& upper, double rho, const TreeProof& proof);
/// The same for the union of several boxes, for the slope at almost every point of each.
TreeVerdict check_tree(const LocalFunction& f, const std::vector<Sides>& boxes, double rho,
                       const TreeProof& proof);

/// Whether least <= y <= most for the outputs y of the last layer, which has no ReLU, all over the box: over each leaf
/// of the tree by neuron_bounds(). Leaves are "t0": there are no multipliers.
TreeVerdict check_range(const std::vector<HiddenLayer>& layers, const std::vector<double>& lower,
                        const std::vector<double>& upper, const std::string& tree,
                        const std::vector<double>& least, const std::vector<double>& most);

}  // namespace swarmcert::check
