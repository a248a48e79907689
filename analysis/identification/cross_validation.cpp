#include "analysis/identification/cross_validation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "analysis/identification/box_least_squares.h"
#include "analysis/identification/covariance.h"
#include "nn/base/doubles.h"

namespace swarmcert::identification {
namespace {

/// With at least this many flights, whole flights are left out.
constexpr std::size_t kFewestWholeFlights = 5;

}  // namespace

Members without(Members members, std::size_t index) {
  members.erase(members.begin() + static_cast<std::ptrdiff_t>(index));
  return members;
}

Members with(Members members, const Member& added) {
  members.push_back(added);
  return members;
}

CrossValidation::CrossValidation(const Grams& grams) : grams_(grams) {
  // Random folds with equal numbers of blocks.
  std::mt19937_64 generator(1);
  std::vector<int>& fold = random_.of_block;
  for (std::size_t i = 0; i < grams.blocks.size(); ++i) fold.push_back(static_cast<int>(i % kFolds));
  for (std::size_t i = fold.size(); i > 1; --i) std::swap(fold[i - 1], fold[generator() % i]);
  divide(random_);
  std::map<int, int> fold_of_flight;
  for (const Block& block : grams.blocks)
    fold_of_flight.emplace(block.flight, static_cast<int>(fold_of_flight.size()) % kFolds);
  has_flights_ = fold_of_flight.size() >= kFewestWholeFlights;
  if (has_flights_) {
    for (const Block& block : grams.blocks) by_flight_.of_block.push_back(fold_of_flight[block.flight]);
    divide(by_flight_);
  }
  const Eigen::Index packed = Eigen::Index(grams.columns) * (grams.columns + 1) / 2;
  total_.gram.setZero(packed);
  total_.b.setZero(grams.columns);
  for (const Sum& sum : random_.inside) {
    total_.gram += sum.gram;
    total_.b += sum.b;
    total_.y += sum.y;
    total_.records += sum.records;
  }
}

void CrossValidation::divide(Folds& folds) const {
  const Eigen::Index packed = Eigen::Index(grams_.columns) * (grams_.columns + 1) / 2;
  for (Sum& sum : folds.inside) {
    sum.gram.setZero(packed);
    sum.b.setZero(grams_.columns);
  }
  for (std::size_t i = 0; i < grams_.blocks.size(); ++i) {
    const Block& block = grams_.blocks[i];
    Sum& sum = folds.inside[static_cast<std::size_t>(folds.of_block[i])];
    sum.gram += block.gram;
    sum.b += block.b;
    sum.y += block.y;
    sum.records += block.records;
  }
  for (std::size_t f = 0; f < kFolds; ++f) {
    Sum& rest = folds.outside[f];
    rest.gram.setZero(packed);
    rest.b.setZero(grams_.columns);
    for (std::size_t other = 0; other < kFolds; ++other) {
      if (other == f) continue;
      rest.gram += folds.inside[other].gram;
      rest.b += folds.inside[other].b;
    }
  }
}

/// Uses whole flights unless an effect was active in only one flight, which is then needed for the fit.
const CrossValidation::Folds& CrossValidation::folds_for(const Members& members) const {
  const bool by_flight = has_flights_ && std::all_of(members.begin(), members.end(), [&](const Member& m) {
                           return support(m).flights >= 2 && candidate(m).vehicles.empty();
                         });
  return by_flight ? by_flight_ : random_;
}

std::vector<int> CrossValidation::columns(const Members& members) const {
  std::vector<int> all;
  for (const Member& m : members) {
    const int first =
        grams_.first_column[static_cast<std::size_t>(m.candidate)][static_cast<std::size_t>(m.theta)];
    for (int c = 0; c < candidate(m).columns(); ++c) all.push_back(first + c);
  }
  return all;
}

Eigen::VectorXd CrossValidation::solve(const Sum& sum, const Members& members) const {
  const std::vector<int> all = columns(members);
  Eigen::VectorXd lower(static_cast<Eigen::Index>(all.size())), upper = lower;
  Eigen::Index i = 0;
  for (const Member& m : members) {
    for (const stability::Parameter& p : candidate(m).info.linear) {
      lower[i] = p.lower;
      upper[i++] = p.upper;
    }
  }
  const Eigen::MatrixXd gram = part_of_gram(sum.gram, all), to = from_model(members);
  const Eigen::VectorXd b = part_of(sum.b, all);
  if (to.isIdentity(0)) return box_least_squares(gram, b, lower, upper);
  return to * box_least_squares(to.transpose() * gram * to, to.transpose() * b, lower, upper);
}

Eigen::MatrixXd CrossValidation::from_model(const Members& members) const {
  std::vector<const Candidate*> effects;
  std::vector<Eigen::Index> first;
  Eigen::Index n = 0;
  for (const Member& m : members) {
    effects.push_back(&candidate(m));
    first.push_back(n);
    n += candidate(m).columns();
  }
  Eigen::MatrixXd to = Eigen::MatrixXd::Identity(n, n);
  for (const ScaledStage& pair : scaled_stages(effects))
    to(first[pair.stage], first[pair.scale]) = 1 / effects[pair.stage]->scale;
  return to;
}

Eigen::VectorXd CrossValidation::in_model(const Members& members, const Eigen::VectorXd& coefficients) const {
  if (coefficients.size() == 0) return coefficients;
  // The inverse of I + N with N N = 0, because no effect is both a scale and a stage.
  const Eigen::MatrixXd to = from_model(members);
  return 2 * coefficients - to * coefficients;
}

Eigen::VectorXd CrossValidation::coefficients(const Members& members) const { return solve(total_, members); }

std::vector<Eigen::VectorXd> CrossValidation::fold_coefficients(const Members& members) const {
  std::vector<Eigen::VectorXd> fits;
  for (const Sum& rest : folds_for(members).outside) fits.push_back(solve(rest, members));
  return fits;
}

double CrossValidation::mean_square(const Members& members) const {
  const Folds& folds = folds_for(members);
  const std::vector<int> all = columns(members);
  double error = 0;
  for (std::size_t f = 0; f < kFolds; ++f) {
    error += folds.inside[f].y;
    if (all.empty()) continue;
    const Eigen::VectorXd c = solve(folds.outside[f], members);
    error += c.dot(part_of_gram(folds.inside[f].gram, all) * c) - 2 * c.dot(part_of(folds.inside[f].b, all));
  }
  return total_.records > 0 ? error / total_.records : kInfinity;
}

std::vector<double> CrossValidation::block_errors(const Members& members) const {
  const Folds& folds = folds_for(members);
  const std::vector<int> all = columns(members);
  std::array<Eigen::VectorXd, kFolds> fits;
  for (std::size_t f = 0; f < kFolds && !all.empty(); ++f) fits[f] = solve(folds.outside[f], members);
  std::vector<double> errors;
  for (std::size_t i = 0; i < grams_.blocks.size(); ++i) {
    const Block& block = grams_.blocks[i];
    double error = block.y;
    if (!all.empty()) {
      const Eigen::VectorXd& c = fits[static_cast<std::size_t>(folds.of_block[i])];
      error += c.dot(part_of_gram(block.gram, all) * c) - 2 * c.dot(part_of(block.b, all));
    }
    errors.push_back(std::max(error, 0.0));
  }
  return errors;
}

Members CrossValidation::ordered(Members members) const {
  Members result;
  while (!members.empty()) {
    std::vector<double> squares;
    for (const Member& member : members) squares.push_back(mean_square(with(result, member)));
    const auto best =
        static_cast<std::size_t>(std::min_element(squares.begin(), squares.end()) - squares.begin());
    result.push_back(members[best]);
    members = without(members, best);
  }
  return result;
}

bool CrossValidation::is_held(const Members& members) const {
  if (!candidate(members.back()).info.remembers) return false;
  const Eigen::VectorXd c = in_model(members, coefficients(members));
  return std::abs(c[c.size() - 1] - 1) > 0.999 * kMemoryTolerance;
}

Member CrossValidation::best_theta(const Members& members, int which) const {
  Member best{which, 0};
  double least = kInfinity;
  bool best_is_held = true;
  const auto thetas = static_cast<int>(grams().candidates[static_cast<std::size_t>(which)].thetas.size());
  for (int t = 0; t < thetas; ++t) {
    const Member member{which, t};
    const Members after = with(members, member);
    // A neighbouring theta of a coarse grid may fit better with a gain at its bound, but that is not a lag.
    const bool held = is_held(after);
    if (held && !best_is_held) continue;
    const double square = mean_square(after);
    // Of thetas that differ only by round-off, use the first, which is the default.
    if (square < least * (1 - 1e-9) || (best_is_held && !held)) {
      least = square;
      best = member;
      best_is_held = held;
    }
  }
  return best;
}

Fit CrossValidation::fit(const Members& members) const {
  Fit result;
  result.coefficients = solve(total_, members);
  const std::vector<int> all = columns(members);
  std::vector<Block> blocks;
  std::vector<int> free;
  for (const Block& block : grams_.blocks) {
    Block small;
    small.follows = block.follows;
    small.b = part_of(block.b, all);
    const Eigen::MatrixXd gram = part_of_gram(block.gram, all);
    small.gram.resize(gram.rows() * (gram.rows() + 1) / 2);
    for (int j = 0; j < gram.rows(); ++j)
      small.gram.segment(Eigen::Index(j) * (j + 1) / 2, j + 1) = gram.col(j).head(j + 1);
    blocks.push_back(std::move(small));
  }
  for (int i = 0; i < static_cast<int>(all.size()); ++i) free.push_back(i);
  result.covariance = sandwich(blocks, free, result.coefficients);
  return result;
}

double CrossValidation::wald(const Members& members) const {
  const Fit f = fit(members);
  const Eigen::Index p = candidate(members.back()).columns();
  const Eigen::VectorXd c = f.coefficients.tail(p);
  Eigen::MatrixXd v = f.covariance.bottomRightCorner(p, p);
  for (Eigen::Index i = 0; i < p; ++i) v(i, i) += 1e-12 * v(i, i) + 1e-30;
  const double statistic = c.dot(v.ldlt().solve(c));
  return std::sqrt(std::max(0.0, statistic - 3 * static_cast<double>(p - 1)));
}

}  // namespace swarmcert::identification
