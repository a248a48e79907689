#include "stability/bounds/loops/vector_gain.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <queue>
#include <vector>

#include "stability/bounds/loops/sampled_model.h"
#include "stability/gains_matrices.h"

namespace swarmcert::stability {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// Cell lengths in radians of the fastest remaining mode: kFine for the reported sums (they differ by about kFine^2/8
/// of the gain), kCoarse for the search of the worst direction.
constexpr double kFine = 0.0012;
constexpr double kCoarse = 0.02;
constexpr double kNegligibleExponent = 45;
constexpr int kMostTriangles = 800;

/// H on a graded partition of time, with the integral of H over each cell.
struct Partition {
  std::vector<Matrix3d> at_node;    ///< H'
  std::vector<Matrix3d> over_cell;  ///< int H' over a cell
  std::vector<double> length_s;
  std::vector<double> remainder;  ///< length^3/12 sup |H''|
  double tail = 0;                ///< int |H| after the last node
};

Partition partition(const Matrix3d& Lambda, const Matrix3d& K, double mass_kg, double cell) {
  // e' = -Lambda e + q, q' = -Lambda q + r, r' = -(K/m) r, r(0) = I/m.
  MatrixXd A = MatrixXd::Zero(9, 9);
  A.block<3, 3>(0, 0) = -Lambda;
  A.block<3, 3>(0, 3).setIdentity();
  A.block<3, 3>(3, 3) = -Lambda;
  A.block<3, 3>(3, 6).setIdentity();
  A.block<3, 3>(6, 6) = -K / mass_kg;
  const MatrixXd antiderivative = A.inverse().topRows(3);
  const MatrixXd curvature = (A * A).topRows(3);
  const Vector3d of_Lambda = Eigen::SelfAdjointEigenSolver<Matrix3d>(Lambda).eigenvalues();
  const Vector3d of_K = Eigen::SelfAdjointEigenSolver<Matrix3d>(K).eigenvalues() / mass_kg;
  const double slowest = std::min(of_Lambda.minCoeff(), of_K.minCoeff());
  const double fastest = std::max(of_Lambda.maxCoeff(), of_K.maxCoeff());

  MatrixXd x = MatrixXd::Zero(9, 3);
  x.bottomRows(3) = Matrix3d::Identity() / mass_kg;
  Partition result;
  result.at_node.emplace_back(x.topRows(3).transpose());
  double t_s = 0;
  double active = fastest;
  double length_s = 0;
  MatrixXd step;
  while (slowest * t_s < kNegligibleExponent) {
    double still = slowest;
    for (const Vector3d* rates : {&of_Lambda, &of_K}) {
      for (const double rate : *rates) {
        if (rate * t_s < kNegligibleExponent) still = std::max(still, rate);
      }
    }
    if (length_s == 0 || still < active / 2) {
      active = still;
      length_s = cell / active;
      step = exponential(A * length_s);
    }
    const MatrixXd next = step * x;
    result.over_cell.emplace_back((antiderivative * (next - x)).transpose());
    result.at_node.emplace_back(next.topRows(3).transpose());
    result.length_s.push_back(length_s);
    const double bend = std::max((curvature * x).norm(), (curvature * next).norm());
    result.remainder.push_back(1.01 * bend * length_s * length_s * length_s / 12);
    x = next;
    t_s += length_s;
  }
  // |exp(-slowest t)| times a polynomial, e^-45 of the peak: far below round-off. The antiderivative bounds its
  // magnitude.
  result.tail = 10 * (antiderivative * x).norm();
  return result;
}

double below(const Partition& p, const Vector3d& eta) {
  double total = 0;
  for (const Matrix3d& cell : p.over_cell) total += (cell * eta).norm();
  return total;
}

double above(const Partition& p, const Vector3d& eta) {
  double total = p.tail;
  double before = (p.at_node[0] * eta).norm();
  for (std::size_t i = 0; i < p.length_s.size(); ++i) {
    const double after = (p.at_node[i + 1] * eta).norm();
    total += (before + after) / 2 * p.length_s[i] + p.remainder[i];
    before = after;
  }
  return total;
}

/// Gradient and Hessian of J at eta by the trapezoidal rule: int H H'/w eta, int (H H'/w - v v'/w^3), v = H H'eta,
/// w = |H'eta|.
void derivatives(const Partition& p, const Vector3d& eta, Vector3d& gradient, Matrix3d& hessian) {
  gradient.setZero();
  hessian.setZero();
  for (std::size_t i = 1; i < p.length_s.size(); ++i) {  // H vanishes at both ends
    const Matrix3d& H = p.at_node[i];
    const Vector3d response = H * eta;
    const double w = response.norm();
    if (!(w > 0)) continue;
    const Vector3d v = H.transpose() * response;
    const double weight = (p.length_s[i - 1] + p.length_s[i]) / (2 * w);
    gradient += weight * v;
    hessian += weight * (H.transpose() * H - v * v.transpose() / (w * w));
  }
}

/// Local maximum of J on the sphere near `eta`: Newton steps in the tangent plane along directions of negative
/// curvature, gradient steps along the others; far away, the direction of the gradient, which never decreases the
/// convex J.
Vector3d ascend(const Partition& p, Vector3d eta, int most_steps) {
  for (int i = 0; i < most_steps; ++i) {
    Vector3d gradient;
    Matrix3d hessian;
    derivatives(p, eta, gradient, hessian);
    const Matrix3d tangent = Matrix3d::Identity() - eta * eta.transpose();
    const Matrix3d curvature = tangent * hessian * tangent - eta.dot(gradient) * tangent;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(curvature);
    Vector3d step = Vector3d::Zero();
    const double flat = 1e-9 * eta.dot(gradient);
    for (int k = 0; k < 3; ++k) {
      const Vector3d direction = solver.eigenvectors().col(k);
      if (std::abs(direction.dot(eta)) > 0.5) continue;
      const double uphill = direction.dot(gradient);
      const double bend = solver.eigenvalues()[k];
      step += direction * (bend < -flat ? -uphill / bend : uphill / eta.dot(gradient));
    }
    if (step.norm() > 0.3) {
      eta = gradient.normalized();
      continue;
    }
    eta = (eta + step).normalized();
    if (step.norm() < 1e-12) break;
  }
  return eta;
}

/// Upper bound on J over all directions by the concavity of the square root; see the header.
double concave_bound(const Partition& p, const Vector3d& eta) {
  // The bound holds for any w > 0; the integrals are bounded above by the trapezoidal rule on exact node values plus
  // remainders.
  Matrix3d Q = Matrix3d::Zero();
  double total_w = 0;
  double floor = 0;
  for (const Matrix3d& H : p.at_node) floor = std::max(floor, (H * eta).norm());
  floor *= 1e-9;  // keeps 1/w finite where H'eta vanishes
  for (std::size_t i = 0; i < p.length_s.size(); ++i) {
    const double w = std::max(((p.at_node[i] * eta).norm() + (p.at_node[i + 1] * eta).norm()) / 2, floor);
    // |H'eta| on the cell is at most the chord plus its deviation: integrate |H'eta|^2 exactly on the chord.
    const Matrix3d& a = p.at_node[i];
    const Matrix3d& b = p.at_node[i + 1];
    Q += (a.transpose() * a + b.transpose() * b + (a + b).transpose() * (a + b)) * (p.length_s[i] / (6 * w));
    total_w += w * p.length_s[i];
  }
  double bend = p.tail;
  for (const double r : p.remainder) bend += r;
  return (total_w + Eigen::SelfAdjointEigenSolver<Matrix3d>(Q).eigenvalues()[2]) / 2 + bend;
}

struct Corner {
  Vector3d eta;
  double value;
};

struct Triangle {
  Corner corner[3];
  double bound;
  bool operator<(const Triangle& other) const { return bound < other.bound; }
};

/// Largest value on the unit sphere of the linear function through the corners, which bounds J on their cone.
Triangle make_triangle(const Corner& a, const Corner& b, const Corner& c) {
  Matrix3d corners;
  corners << a.eta.transpose(), b.eta.transpose(), c.eta.transpose();
  const Vector3d gradient = corners.partialPivLu().solve(Vector3d(a.value, b.value, c.value));
  return {{a, b, c}, gradient.norm()};
}

/// Covers half of the sphere (J is even) until the bound is within `gap` of `lower` or the budget is exhausted.
double sphere_bound(const Partition& p, double lower, double gap) {
  const auto corner = [&p](const Vector3d& direction) {
    const Vector3d eta = direction.normalized();
    return Corner{eta, above(p, eta)};
  };
  const Corner x = corner({1, 0, 0}), y = corner({0, 1, 0}), z = corner({0, 0, 1});
  const Corner minus_x = {-x.eta, x.value}, minus_y = {-y.eta, y.value};
  std::priority_queue<Triangle> open;
  open.push(make_triangle(x, y, z));
  open.push(make_triangle(y, minus_x, z));
  open.push(make_triangle(minus_x, minus_y, z));
  open.push(make_triangle(minus_y, x, z));
  for (int i = 0; i < kMostTriangles && open.top().bound > lower + gap; ++i) {
    const Triangle t = open.top();
    open.pop();
    int longest = 0;  // bisect the longest edge
    double least = 2;
    for (int e = 0; e < 3; ++e) {
      const double cosine = t.corner[e].eta.dot(t.corner[(e + 1) % 3].eta);
      if (cosine < least) least = cosine, longest = e;
    }
    const Corner& a = t.corner[longest];
    const Corner& b = t.corner[(longest + 1) % 3];
    const Corner& c = t.corner[(longest + 2) % 3];
    const Corner middle = corner(a.eta + b.eta);
    open.push(make_triangle(a, middle, c));
    open.push(make_triangle(middle, b, c));
  }
  return open.top().bound;
}

}  // namespace

VectorGain vector_peak_gain(const Matrix3& Lambda, const Matrix3& K, double mass_kg) {
  const Matrix3d L = to_eigen(Lambda), gain = to_eigen(K);
  const Partition p = partition(L, gain, mass_kg, kFine);
  const Partition coarse = partition(L, gain, mass_kg, kCoarse);

  // Starting points: axes, diagonals between them, and the eigenvectors of the matrices.
  std::vector<Vector3d> starts;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = 0; z <= 1; ++z) {
        const Vector3d start(x + 0.01, y + 0.02, z + 0.03);
        starts.push_back(start.normalized());
      }
    }
  }
  for (const Matrix3d& m : {L, gain}) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(m);
    for (int i = 0; i < 3; ++i) starts.emplace_back(solver.eigenvectors().col(i));
  }
  VectorGain result;
  Vector3d best = starts[0];
  double best_rough = 0;
  for (const Vector3d& start : starts) {
    const Vector3d eta = ascend(coarse, start, 25);
    const double rough = below(coarse, eta);
    if (rough > best_rough) best_rough = rough, best = eta;
  }
  best = ascend(p, best, 4);
  result.lower = below(p, best);
  for (int i = 0; i < 3; ++i) result.direction[static_cast<std::size_t>(i)] = best[i];

  const double least_L = Eigen::SelfAdjointEigenSolver<Matrix3d>(L).eigenvalues()[0];
  const double least_K = Eigen::SelfAdjointEigenSolver<Matrix3d>(gain).eigenvalues()[0];
  const double theorem = 1 / (least_L * least_L * least_K);
  result.upper = std::min(theorem * (1 + 1e-13), concave_bound(p, best));
  const double gap = std::min(5e-7, 1e-7 * result.lower + 2 * (above(p, best) - result.lower));
  if (result.upper > result.lower + gap) {
    result.upper = std::min(result.upper, sphere_bound(p, result.lower, gap));
  }
  result.upper = std::max(result.upper, result.lower);
  return result;
}

}  // namespace swarmcert::stability
