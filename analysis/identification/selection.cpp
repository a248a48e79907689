#include "analysis/identification/selection.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "analysis/identification/box_least_squares.h"
#include "analysis/identification/covariance.h"
#include "nn/files/doubles.h"

namespace swarmcert::identification {
namespace {

/// Whole flights are left out where there are this many.
constexpr std::size_t kFewestFlights = 5;

}  // namespace

Members without(Members members, std::size_t index) {
  members.erase(members.begin() + static_cast<std::ptrdiff_t>(index));
  return members;
}

Members with(Members members, const Member& added) {
  members.push_back(added);
  return members;
}

Selection::Selection(const Grams& grams, Thresholds thresholds) : grams_(grams), thresholds_(thresholds) {
  // Random folds, equally many blocks in each.
  std::mt19937_64 generator(1);
  std::vector<int>& fold = random_.of_block;
  for (std::size_t i = 0; i < grams.blocks.size(); ++i) fold.push_back(static_cast<int>(i % kFolds));
  for (std::size_t i = fold.size(); i > 1; --i) std::swap(fold[i - 1], fold[generator() % i]);
  divide(random_);
  std::map<int, int> fold_of_flight;
  for (const Block& block : grams.blocks)
    fold_of_flight.emplace(block.flight, static_cast<int>(fold_of_flight.size()) % kFolds);
  has_flights_ = fold_of_flight.size() >= kFewestFlights;
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

void Selection::divide(Folds& folds) const {
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

/// Whole flights, unless an effect was active in one flight only: left out, it could not be learned.
const Selection::Folds& Selection::folds_for(const Members& members) const {
  const bool by_flight = has_flights_ && std::all_of(members.begin(), members.end(), [&](const Member& m) {
                           return support(m).flights >= 2 && candidate(m).vehicles.empty();
                         });
  return by_flight ? by_flight_ : random_;
}

std::vector<int> Selection::columns(const Members& members) const {
  std::vector<int> all;
  for (const Member& m : members) {
    const int first =
        grams_.first_column[static_cast<std::size_t>(m.candidate)][static_cast<std::size_t>(m.theta)];
    for (int c = 0; c < candidate(m).columns(); ++c) all.push_back(first + c);
  }
  return all;
}

bool Selection::is_present(const Members& members, int which) const {
  const std::string& name = grams_.candidates[static_cast<std::size_t>(which)].name;
  return std::any_of(members.begin(), members.end(),
                     [&](const Member& m) { return candidate(m).name == name; });
}

Eigen::VectorXd Selection::solve(const Sum& sum, const Members& members) const {
  const std::vector<int> all = columns(members);
  Eigen::VectorXd lower(static_cast<Eigen::Index>(all.size())), upper = lower;
  Eigen::Index i = 0;
  for (const Member& m : members) {
    for (const stability::Parameter& p : candidate(m).info.linear) {
      lower[i] = p.lower;
      upper[i++] = p.upper;
    }
  }
  return box_least_squares(part_of_gram(sum.gram, all), part_of(sum.b, all), lower, upper);
}

std::vector<Eigen::VectorXd> Selection::fold_coefficients(const Members& members) const {
  std::vector<Eigen::VectorXd> fits;
  for (const Sum& rest : folds_for(members).outside) fits.push_back(solve(rest, members));
  return fits;
}

double Selection::mean_square(const Members& members) const {
  return mean_square(members, folds_for(members));
}

double Selection::mean_square(const Members& members, const Folds& folds) const {
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

std::vector<double> Selection::block_errors(const Members& members) const {
  return block_errors(members, folds_for(members));
}

std::vector<double> Selection::block_errors(const Members& members, const Folds& folds) const {
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

Fit Selection::fit(const Members& members) const {
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

double Selection::wald(const Members& members) const {
  const Fit f = fit(members);
  const Eigen::Index p = candidate(members.back()).columns();
  const Eigen::VectorXd c = f.coefficients.tail(p);
  Eigen::MatrixXd v = f.covariance.bottomRightCorner(p, p);
  for (Eigen::Index i = 0; i < p; ++i) v(i, i) += 1e-12 * v(i, i) + 1e-30;
  const double statistic = c.dot(v.ldlt().solve(c));
  return std::sqrt(std::max(0.0, statistic - 3 * static_cast<double>(p - 1)));
}

bool Selection::is_held(const Members& members) const {
  if (!candidate(members.back()).info.remembers) return false;
  const Eigen::VectorXd c = solve(total_, members);
  return std::abs(c[c.size() - 1] - 1) > 0.999 * kMemoryTolerance;
}

Member Selection::best_theta(const Members& members, int which) const {
  Member best{which, 0};
  double least = kInfinity;
  bool best_is_held = true;
  const auto thetas = static_cast<int>(grams_.candidates[static_cast<std::size_t>(which)].thetas.size());
  for (int t = 0; t < thetas; ++t) {
    const Member member{which, t};
    const Members after = with(members, member);
    // A coarse grid's neighbour may fit better with a gain at its bound, but that is no lag.
    const bool held = is_held(after);
    if (held && !best_is_held) continue;
    const double square = mean_square(after);
    if (square < least || (best_is_held && !held)) {
      least = square;
      best = member;
      best_is_held = held;
    }
  }
  return best;
}

bool Selection::is_acceptable(const Members& before, const Member& added) const {
  const Members after = with(before, added);
  const Folds& folds = folds_for(after);
  return is_acceptable(before, added, mean_square(before, folds), mean_square(after, folds), folds);
}

bool Selection::is_acceptable(const Members& before, const Member& added, double before_square,
                              double after_square, const Folds& folds) const {
  if (!(after_square <= (1 - thresholds_.gain) * before_square)) return false;
  const Support& where = support(added);
  const bool is_plain = after_square <= (1 - thresholds_.plain_gain) * before_square;
  const std::size_t blocks = is_plain ? thresholds_.plain_support_blocks : thresholds_.support_blocks;
  if (where.records < thresholds_.support_records || where.blocks < blocks) return false;
  const Members after = with(before, added);
  if (is_held(after)) return false;
  const double z = paired_z(block_errors(before, folds), block_errors(after, folds));
  return z >= thresholds_.paired_z || (z >= thresholds_.least_paired_z && wald(after) >= thresholds_.wald_z);
}

bool Selection::add_one(Members& members) const {
  struct Choice {
    Member member;
    const Folds* folds;
    double before, after;
    int parameters;
    double share() const { return after / before; }
  };
  std::vector<Choice> choices;
  for (int k = 0; k < static_cast<int>(grams_.candidates.size()); ++k) {
    if (is_present(members, k)) continue;
    const Member member = best_theta(members, k);
    const Members after = with(members, member);
    const Folds& folds = folds_for(after);
    choices.push_back({member, &folds, mean_square(members, folds), mean_square(after, folds),
                       candidate(member).columns()});
  }
  std::stable_sort(choices.begin(), choices.end(),
                   [](const Choice& a, const Choice& b) { return a.share() < b.share(); });
  const auto accepts = [&](const Choice& c) {
    return is_acceptable(members, c.member, c.before, c.after, *c.folds);
  };
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (!accepts(choices[i])) continue;
    // Of what does equally well, the effect with the fewest numbers.
    const Choice* best = &choices[i];
    for (std::size_t j = i + 1; j < choices.size(); ++j) {
      if (choices[j].share() - choices[i].share() > thresholds_.swap_gain) break;
      if (choices[j].parameters < best->parameters && accepts(choices[j])) best = &choices[j];
    }
    members.push_back(best->member);
    return true;
  }
  return false;
}

bool Selection::swap_one(Members& members) const {
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Members rest = without(members, i);
    for (int k = 0; k < static_cast<int>(grams_.candidates.size()); ++k) {
      if (is_present(rest, k)) continue;
      const Member member = best_theta(rest, k);
      if (member == members[i]) continue;
      const Members instead = with(rest, member);
      const Folds& folds = folds_for(with(instead, members[i]));
      const double now = mean_square(members, folds), then = mean_square(instead, folds);
      const bool retunes = k == members[i].candidate;
      if (then < (retunes ? 1 - 1e-6 : 1 - thresholds_.swap_gain) * now &&
          is_acceptable(rest, member, mean_square(rest, folds), then, folds)) {
        members[i] = member;
        return true;
      }
    }
  }
  return false;
}

bool Selection::remove_one(Members& members) const {
  const Folds& folds = folds_for(members);
  const double now = mean_square(members, folds);
  std::size_t least = members.size();
  double least_square = kInfinity;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const double square = mean_square(without(members, i), folds);
    if (square < least_square) {
      least_square = square;
      least = i;
    }
  }
  if (least == members.size() || 1 - now / least_square >= thresholds_.removal_share * thresholds_.gain)
    return false;
  members = without(members, least);
  return true;
}

void Selection::prune(Members& members) const {
  while (remove_one(members)) {
  }
}

Members Selection::select() const {
  Members members;
  if (!is_sound()) return members;
  constexpr std::size_t kMostEffects = 10;
  for (int round = 0; round < 20 && members.size() < kMostEffects; ++round) {
    if (!add_one(members)) break;
    for (int i = 0; i < 20 && swap_one(members); ++i) {
    }
    prune(members);
  }
  return ordered(members);
}

Members Selection::ordered(Members members) const {
  // A shape without a memory: ground, jets, ...
  const auto is_local = [&](const Member& m) {
    return !candidate(m).info.shape.empty() && !candidate(m).info.remembers;
  };
  Members result;
  for (const bool local : {true, false}) {
    while (
        std::any_of(members.begin(), members.end(), [&](const Member& m) { return is_local(m) == local; })) {
      std::size_t best = 0;
      double least = kInfinity;
      for (std::size_t i = 0; i < members.size(); ++i) {
        if (is_local(members[i]) != local) continue;
        const double square = mean_square(with(result, members[i]));
        if (square < least) {
          least = square;
          best = i;
        }
      }
      result.push_back(members[best]);
      members = without(members, best);
    }
  }
  return result;
}

}  // namespace swarmcert::identification
