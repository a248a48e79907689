/// @file Maxima of many linear forms in the outputs of one ReLU network over a box.
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
  int halved = 0;  ///< maximum number of parts halved for each form
  /// The search for a form ends when its gap is at most this share of the range of its values.
  double gap = 0;
  int jobs = 1;  ///< threads; the result does not depend on them
};

/// Maxima of forms c y over the box, one entry or column per form.
struct LargestValues {
  Eigen::VectorXd upper;  ///< upper bounds on the maxima, in exact arithmetic
  Eigen::VectorXd value;  ///< estimates of c y(x)
  Eigen::MatrixXd x;      ///< points of the box, [inputs x forms]
};

/// Best-first branch and bound for many linear forms c y in the outputs of one network. Parts of the box are halved on
/// demand and kept for later forms. Bounding a form over an existing part takes one backward substitution (reach.h),
/// which costs two hundredths of bounding all neurons.
///
/// Round-off is bounded as in Reach, using the magnitudes that Reach finds over the whole box, because points of a part
/// are points of the box.
class PartTree {
 public:
  /// @param network must outlive the tree.
  /// @param box finite.
  PartTree(const ReachNetwork& network, const Box& box);
  ~PartTree();

  /// Returns the maxima of the forms over the box.
  /// @param forms [forms x outputs].
  LargestValues largest(const Eigen::MatrixXd& forms, const PartSearch& search);

 private:
  struct Layer {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> weights;
    Eigen::VectorXd bias;
    Eigen::VectorXd error;       ///< round-off error per unit of a coefficient of y
    Eigen::VectorXd line_error;  ///< and per unit of a coefficient of relu(y) and of a line's slope
  };
  /// relu(y) <= slope y + offset for a neuron that is not off; relu(y) >= y if the slope is above 1/2, else >= 0.
  struct Line {
    double slope, offset;
    Eigen::Index neuron;
  };
  struct Part {
    Box box;
    std::vector<std::vector<Line>> lines;  ///< by hidden layer
    std::shared_ptr<const Reach> reach;    ///< null after the part is halved
    std::size_t first_child = 0;           ///< index of the first half, the second follows; 0: not halved
  };
  /// Constant and error accumulated during the backward substitution of a form.
  struct Left {
    double constant = 0, error = 0;
  };
  /// A form to be bounded on the two halves of a part.
  struct Wanted {
    std::size_t form;
    double upper;  ///< bound of the form on the part
  };
  using Work = std::map<std::size_t, std::vector<Wanted>>;  ///< by part
  struct Form;
  struct Seen;
  struct Scratch;

  Part part_of(const Box& box, const Reach* around) const;
  /// Halves a part along the coordinate in which the form may change most, and bounds both halves.
  void halve(std::size_t index, const Eigen::RowVectorXd& form);
  Form& form_of(const Eigen::RowVectorXd& direction);
  static void pull_back(const Layer& layer, const std::vector<Line>& lines, double relative,
                        const double* coefficients, double* next, Left& left);
  /// Returns an upper bound on the form over a part; sets scratch.x to the corner where the bounding form is largest.
  double above(const Part& part, const Form& form, Scratch& scratch) const;
  /// Bounds the form on both halves of a part and evaluates it at the corner of the half with the larger bound.
  Seen look(const Part& first, const Part& second, const Form& form, Scratch& scratch) const;
  /// Moves the parts that are to be halved from a form's queue to `wanted`.
  void choose(std::size_t index, Form& form, const PartSearch& search, Work& wanted);
  void refine(const std::vector<Form*>& forms, const Work& wanted, int jobs);

  const ReachNetwork& network_;
  std::vector<Layer> layers_;
  double relative_ = 0;  ///< relative round-off error per term of a constant
  std::deque<Part> parts_;
  std::map<std::vector<double>, Form> forms_;  ///< searches so far, by form
  Eigen::MatrixXd points_, sampled_;           ///< points of the box and approximate y there, one per column
};

}  // namespace swarmcert::lipschitz
