/// @file Largest values of many linear forms in the outputs of one ReLU network over a box.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

struct PartSearch {
  int halved = 0;  ///< parts that are halved for each form, at most
  /// A form's search ends where what is left is at most this share of how far its values are apart.
  double gap = 0;
  int jobs = 1;  ///< threads; the result does not depend on them
};

/// What forms c y take over the box, one entry or column per form.
struct LargestValues {
  Eigen::VectorXd upper;  ///< at least the largest value, in exact arithmetic
  Eigen::VectorXd value;  ///< about c y(x): an estimate
  Eigen::MatrixXd x;      ///< in the box, [inputs x forms]
};

/// Best-first branch and bound for many linear forms c y in the outputs of one network. Parts of the box are halved
/// where a form asks for it, and kept for the forms that follow: a form over a part that is there costs one backward
/// substitution (reach.h), two hundredths of what bounds on all neurons cost.
///
/// Rounding is accounted for as in Reach. What it costs is measured by the magnitudes that Reach finds over the whole
/// box, since points of a part are points of the box.
class PartTree {
 public:
  /// @param network outlives the tree.
  /// @param box finite.
  PartTree(const ReachNetwork& network, const Box& box);
  ~PartTree();

  /// @param forms [forms x outputs].
  LargestValues largest(const Eigen::MatrixXd& forms, const PartSearch& search);

 private:
  struct Layer {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> weights;
    Eigen::VectorXd bias;
    Eigen::VectorXd error;       ///< what rounding costs per unit of a coefficient of y
    Eigen::VectorXd line_error;  ///< and per unit of a coefficient of relu(y) and of a line's slope
  };
  /// relu(y) <= slope y + offset of a neuron that is not off; >= y if the slope is above 1/2, else >= 0.
  struct Line {
    double slope, offset;
    Eigen::Index neuron;
  };
  struct Part {
    Box box;
    std::vector<std::vector<Line>> lines;  ///< by hidden layer
    std::shared_ptr<const Reach> reach;    ///< until it is halved
    std::size_t first_child = 0;           ///< the second one follows; 0: not halved
  };
  /// What a form leaves behind on its way back to the inputs.
  struct Left {
    double constant = 0, error = 0;
  };
  /// A form on the two halves of a part.
  struct Wanted {
    std::size_t form;
    double upper;  ///< its bound on the part
  };
  using Work = std::map<std::size_t, std::vector<Wanted>>;  ///< by part
  struct Form;
  struct Seen;
  struct Scratch;

  Part part_of(const Box& box, const Reach* around) const;
  /// Bounds on both halves of a part, across the dimension along which the form may change most.
  void halve(std::size_t index, const Eigen::RowVectorXd& form);
  Form& form_of(const Eigen::RowVectorXd& direction);
  static void pull_back(const Layer& layer, const std::vector<Line>& lines, double relative,
                        const double* coefficients, double* next, Left& left);
  /// At least the form over a part; sets scratch.x, the corner where what is above it is largest.
  double above(const Part& part, const Form& form, Scratch& scratch) const;
  /// Both halves of a part, and a value at the corner of the half with the larger bound.
  Seen look(const Part& first, const Part& second, const Form& form, Scratch& scratch) const;
  /// Takes parts off a form's queue that are to be halved.
  void choose(std::size_t index, Form& form, const PartSearch& search, Work& wanted);
  void refine(const std::vector<Form*>& forms, const Work& wanted, int jobs);

  const ReachNetwork& network_;
  std::vector<Layer> layers_;
  double relative_ = 0;  ///< what rounding costs per term of a constant
  std::deque<Part> parts_;
  std::map<std::vector<double>, Form> forms_;  ///< searches so far, by form
  Eigen::MatrixXd points_, sampled_;           ///< points of the box and about y there, one per column
};

}  // namespace swarmcert::lipschitz
