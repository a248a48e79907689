#include "analysis/identification/selection.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "analysis/residuals/statistics.h"

namespace swarmcert::identification {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// argmin y - 2 c'b + c'Gc within lower <= c <= upper. Active set: violated bounds are fixed, and released where the
/// gradient points inside.
Eigen::VectorXd box_least_squares(const Eigen::MatrixXd& gram, const Eigen::VectorXd& b,
                                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  const auto n = static_cast<int>(b.size());
  std::vector<int> state(static_cast<std::size_t>(n), 0);  // -1, 0, 1: at lower bound, free, at upper bound
  for (int i = 0; i < n; ++i) {
    if (lower[i] == upper[i]) state[static_cast<std::size_t>(i)] = -1;
  }
  Eigen::VectorXd c = Eigen::VectorXd::Zero(n);
  for (int pass = 0; pass < 6 * n + 6; ++pass) {
    std::vector<int> free;
    for (int i = 0; i < n; ++i) {
      const int s = state[static_cast<std::size_t>(i)];
      if (s == 0)
        free.push_back(i);
      else
        c[i] = s < 0 ? lower[i] : upper[i];
    }
    const auto m = static_cast<int>(free.size());
    Eigen::MatrixXd g(m, m);
    Eigen::VectorXd rhs(m);
    for (int i = 0; i < m; ++i) {
      const int fi = free[static_cast<std::size_t>(i)];
      rhs[i] = b[fi];
      for (int k = 0; k < n; ++k) {
        if (state[static_cast<std::size_t>(k)] != 0) rhs[i] -= gram(fi, k) * c[k];
      }
      for (int j = 0; j < m; ++j) g(i, j) = gram(fi, free[static_cast<std::size_t>(j)]);
      g(i, i) += 1e-10 * gram(fi, fi) + 1e-18;
    }
    if (m > 0) {
      const Eigen::VectorXd solution = g.ldlt().solve(rhs);
      for (int i = 0; i < m; ++i) c[free[static_cast<std::size_t>(i)]] = solution[i];
    }
    int worst = -1;
    double most = 0;
    for (const int i : free) {
      const double scale = std::sqrt(std::max(gram(i, i), 0.0));
      const double beyond = scale * std::max(lower[i] - c[i], c[i] - upper[i]);
      if (beyond > most) {
        most = beyond;
        worst = i;
      }
    }
    if (worst >= 0) {
      state[static_cast<std::size_t>(worst)] = c[worst] < lower[worst] ? -1 : 1;
      continue;
    }
    const Eigen::VectorXd gradient = b - gram * c;
    most = 1e-9 * std::abs(b.cwiseAbs().maxCoeff());
    for (int i = 0; i < n; ++i) {
      const int s = lower[i] == upper[i] ? 0 : state[static_cast<std::size_t>(i)];
      const double inside = s < 0 ? gradient[i] : s > 0 ? -gradient[i] : 0;
      if (inside > most) {
        most = inside;
        worst = i;
      }
    }
    if (worst < 0) break;
    state[static_cast<std::size_t>(worst)] = 0;
  }
  return c.cwiseMax(lower).cwiseMin(upper);
}

double paired_z(const std::vector<double>& before, const std::vector<double>& after) {
  const auto n = static_cast<double>(before.size());
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double d = before[i] - after[i];
    sum += d;
    squares += d * d;
  }
  const double variance = squares / n - (sum / n) * (sum / n);
  return variance > 0 ? sum / n / std::sqrt(variance / n) : 0;
}

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

std::pair<double, double> drop_interval(const std::vector<double>& before, const std::vector<double>& after) {
  std::mt19937_64 generator(1);
  std::vector<double> drops;
  for (int i = 0; i < 200; ++i) {
    double a = 0, b = 0;
    for (std::size_t k = 0; k < before.size(); ++k) {
      const std::size_t j = generator() % before.size();
      b += before[j];
      a += after[j];
    }
    drops.push_back(1 - std::sqrt(std::max(a, 0.0) / b));
  }
  return {residuals::quantile(drops, 0.05), residuals::quantile(drops, 0.95)};
}

std::vector<Member> without(std::vector<Member> members, std::size_t index) {
  members.erase(members.begin() + static_cast<std::ptrdiff_t>(index));
  return members;
}

std::vector<Member> with(std::vector<Member> members, const Member& added) {
  members.push_back(added);
  return members;
}

}  // namespace

Selection::Selection(const Grams& grams, Thresholds thresholds) : grams_(grams), thresholds_(thresholds) {
  const Eigen::Index packed = Eigen::Index(grams.columns) * (grams.columns + 1) / 2;
  const auto clear = [&](Sum& sum) {
    sum.gram.setZero(packed);
    sum.b.setZero(grams.columns);
  };
  clear(total_);
  for (Sum& sum : folds_) clear(sum);
  // Random folds, equally many blocks in each.
  std::mt19937_64 generator(1);
  for (std::size_t i = 0; i < grams.blocks.size(); ++i) fold_.push_back(static_cast<int>(i % kFolds));
  for (std::size_t i = fold_.size(); i > 1; --i) std::swap(fold_[i - 1], fold_[generator() % i]);
  for (std::size_t i = 0; i < grams.blocks.size(); ++i) {
    const Block& block = grams.blocks[i];
    for (Sum* sum : {&total_, &folds_[static_cast<std::size_t>(fold_[i])]}) {
      sum->gram += block.gram;
      sum->b += block.b;
      sum->y += block.y;
      sum->records += block.records;
    }
  }
}

std::vector<int> Selection::columns(const std::vector<Member>& members) const {
  std::vector<int> all;
  for (const Member& m : members) {
    const auto k = static_cast<std::size_t>(m.candidate);
    const int first = grams_.first_column[k][static_cast<std::size_t>(m.theta)];
    for (std::size_t c = 0; c < grams_.candidates[k].info.linear.size(); ++c)
      all.push_back(first + static_cast<int>(c));
  }
  return all;
}

Eigen::MatrixXd Selection::sub_gram(const Eigen::VectorXd& packed, const std::vector<int>& columns) const {
  const auto n = static_cast<int>(columns.size());
  Eigen::MatrixXd g(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j)
      g(i, j) =
          packed[Grams::packed(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)])];
  }
  return g;
}

namespace {

Eigen::VectorXd part_of(const Eigen::VectorXd& all, const std::vector<int>& columns) {
  Eigen::VectorXd part(static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) part[static_cast<Eigen::Index>(i)] = all[columns[i]];
  return part;
}

}  // namespace

Eigen::VectorXd Selection::solve(const Sum& sum, const std::vector<Member>& members) const {
  const std::vector<int> all = columns(members);
  Eigen::VectorXd lower(static_cast<Eigen::Index>(all.size())), upper = lower;
  Eigen::Index i = 0;
  for (const Member& m : members) {
    for (const stability::Parameter& p :
         grams_.candidates[static_cast<std::size_t>(m.candidate)].info.linear) {
      lower[i] = p.lower;
      upper[i++] = p.upper;
    }
  }
  return box_least_squares(sub_gram(sum.gram, all), part_of(sum.b, all), lower, upper);
}

std::array<Eigen::VectorXd, Selection::kFolds> Selection::fold_fits(
    const std::vector<Member>& members) const {
  std::array<Eigen::VectorXd, kFolds> fits;
  const std::vector<int> all = columns(members);
  if (all.empty()) return fits;
  for (std::size_t f = 0; f < kFolds; ++f) {
    Sum rest;
    rest.gram = total_.gram - folds_[f].gram;
    rest.b = total_.b - folds_[f].b;
    fits[f] = solve(rest, members);
  }
  return fits;
}

double Selection::mean_square(const std::vector<Member>& members) const {
  const auto fits = fold_fits(members);
  const std::vector<int> all = columns(members);
  double error = 0;
  for (std::size_t f = 0; f < kFolds; ++f) {
    error += folds_[f].y;
    if (all.empty()) continue;
    error +=
        fits[f].dot(sub_gram(folds_[f].gram, all) * fits[f]) - 2 * fits[f].dot(part_of(folds_[f].b, all));
  }
  return total_.records > 0 ? error / total_.records : kInfinity;
}

std::vector<double> Selection::block_errors(const std::vector<Member>& members) const {
  const auto fits = fold_fits(members);
  const std::vector<int> all = columns(members);
  std::vector<double> errors;
  for (std::size_t i = 0; i < grams_.blocks.size(); ++i) {
    const Block& block = grams_.blocks[i];
    double error = block.y;
    if (!all.empty()) {
      const Eigen::VectorXd& c = fits[static_cast<std::size_t>(fold_[i])];
      error += c.dot(sub_gram(block.gram, all) * c) - 2 * c.dot(part_of(block.b, all));
    }
    errors.push_back(std::max(error, 0.0));
  }
  return errors;
}

Fit Selection::fit(const std::vector<Member>& members) const {
  Fit result;
  result.coefficients = solve(total_, members);
  const std::vector<int> all = columns(members);
  const auto n = static_cast<Eigen::Index>(all.size());
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(n, n);
  for (const Block& block : grams_.blocks) {
    const Eigen::VectorXd score = part_of(block.b, all) - sub_gram(block.gram, all) * result.coefficients;
    meat += score * score.transpose();
  }
  Eigen::MatrixXd gram = sub_gram(total_.gram, all);
  for (Eigen::Index i = 0; i < n; ++i) gram(i, i) += 1e-10 * gram(i, i) + 1e-18;
  const Eigen::MatrixXd inverse = gram.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  const auto blocks = static_cast<double>(grams_.blocks.size());
  result.covariance = inverse * meat * inverse * (blocks / std::max(1.0, blocks - static_cast<double>(n)));
  return result;
}

/// Of the last member, on the scale of one coefficient: comparable whatever its number of columns.
double Selection::wald(const std::vector<Member>& members) const {
  const Fit f = fit(members);
  const auto p = static_cast<Eigen::Index>(
      grams_.candidates[static_cast<std::size_t>(members.back().candidate)].info.linear.size());
  const Eigen::VectorXd c = f.coefficients.tail(p);
  Eigen::MatrixXd v = f.covariance.bottomRightCorner(p, p);
  for (Eigen::Index i = 0; i < p; ++i) v(i, i) += 1e-12 * v(i, i) + 1e-30;
  const double statistic = c.dot(v.ldlt().solve(c));
  return std::sqrt(std::max(0.0, statistic - 3 * static_cast<double>(p - 1)));
}

Member Selection::best_theta(const std::vector<Member>& members, int candidate) const {
  Member best{candidate, 0};
  double least = kInfinity;
  const auto& thetas = grams_.candidates[static_cast<std::size_t>(candidate)].thetas;
  for (std::size_t t = 0; t < thetas.size(); ++t) {
    const Member member{candidate, static_cast<int>(t)};
    const double square = mean_square(with(members, member));
    if (square < least) {
      least = square;
      best = member;
    }
  }
  return best;
}

bool Selection::is_acceptable(const std::vector<Member>& before, const Member& added, double before_square,
                              double after_square) const {
  if (!(after_square <= (1 - thresholds_.gain) * before_square)) return false;
  const auto k = static_cast<std::size_t>(added.candidate);
  const Support& support = grams_.support[k][static_cast<std::size_t>(added.theta)];
  if (support.records < thresholds_.support_records || support.blocks < thresholds_.support_blocks)
    return false;
  const std::vector<Member> after = with(before, added);
  if (grams_.candidates[k].info.remembers) {
    const Eigen::VectorXd c = solve(total_, after);
    if (std::abs(c[c.size() - 1] - 1) > thresholds_.memory_tolerance) return false;
  }
  const double z = paired_z(block_errors(before), block_errors(after));
  return z >= thresholds_.paired_z || (z >= thresholds_.least_paired_z && wald(after) >= thresholds_.wald_z);
}

bool Selection::add_one(std::vector<Member>& members) const {
  const double before = mean_square(members);
  struct Choice {
    Member member;
    double square;
    std::size_t parameters;
  };
  std::vector<Choice> choices;
  for (int k = 0; k < static_cast<int>(grams_.candidates.size()); ++k) {
    const bool present =
        std::any_of(members.begin(), members.end(), [k](const Member& m) { return m.candidate == k; });
    if (present) continue;
    const Member member = best_theta(members, k);
    choices.push_back({member, mean_square(with(members, member)),
                       grams_.candidates[static_cast<std::size_t>(k)].info.linear.size()});
  }
  std::stable_sort(choices.begin(), choices.end(),
                   [](const Choice& a, const Choice& b) { return a.square < b.square; });
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (!is_acceptable(members, choices[i].member, before, choices[i].square)) continue;
    // Of what does equally well, the effect with the fewest numbers.
    const Choice* best = &choices[i];
    for (std::size_t j = i + 1; j < choices.size(); ++j) {
      if (choices[j].square - choices[i].square > thresholds_.swap_gain * before) break;
      if (choices[j].parameters < best->parameters &&
          is_acceptable(members, choices[j].member, before, choices[j].square))
        best = &choices[j];
    }
    members.push_back(best->member);
    return true;
  }
  return false;
}

bool Selection::swap_one(std::vector<Member>& members) const {
  const double now = mean_square(members);
  for (std::size_t i = 0; i < members.size(); ++i) {
    const std::vector<Member> rest = without(members, i);
    const double rest_square = mean_square(rest);
    for (int k = 0; k < static_cast<int>(grams_.candidates.size()); ++k) {
      const bool present =
          std::any_of(rest.begin(), rest.end(), [k](const Member& m) { return m.candidate == k; });
      if (present) continue;
      const Member member = best_theta(rest, k);
      if (member == members[i]) continue;
      const double square = mean_square(with(rest, member));
      const bool retunes = k == members[i].candidate;
      if (square < (retunes ? 1 - 1e-6 : 1 - thresholds_.swap_gain) * now &&
          is_acceptable(rest, member, rest_square, square)) {
        members[i] = member;
        return true;
      }
    }
  }
  return false;
}

bool Selection::remove_one(std::vector<Member>& members) const {
  const double now = mean_square(members);
  std::size_t least = members.size();
  double least_square = kInfinity;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const double square = mean_square(without(members, i));
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

std::vector<Member> Selection::select() const {
  std::vector<Member> members;
  if (!is_sound()) return members;
  constexpr std::size_t kMostEffects = 10;
  for (int round = 0; round < 20 && members.size() < kMostEffects; ++round) {
    if (!add_one(members)) break;
    for (int i = 0; i < 20 && swap_one(members); ++i) {
    }
    while (remove_one(members)) {
    }
  }
  // In the order in which they lower the error most.
  std::vector<Member> ordered;
  while (!members.empty()) {
    std::size_t best = 0;
    double least = kInfinity;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const double square = mean_square(with(ordered, members[i]));
      if (square < least) {
        least = square;
        best = i;
      }
    }
    ordered.push_back(members[best]);
    members = without(members, best);
  }
  return ordered;
}

std::vector<Finding> Selection::findings(const std::vector<Member>& members) const {
  constexpr double kQuantile90 = 1.6449;  // two-sided 90 % of the normal distribution
  std::vector<Finding> result;
  if (members.empty()) return result;
  const Fit full = fit(members);
  const double full_square = mean_square(members);
  const std::vector<double> full_errors = block_errors(members);
  Eigen::Index at = 0;
  std::vector<Member> prefix;
  for (std::size_t i = 0; i < members.size(); ++i) {
    Finding finding;
    finding.member = members[i];
    const auto k = static_cast<std::size_t>(members[i].candidate);
    finding.support = grams_.support[k][static_cast<std::size_t>(members[i].theta)];
    const std::vector<double> before = block_errors(prefix);
    prefix.push_back(members[i]);
    const std::vector<double> after = block_errors(prefix);
    finding.rmse_before_N = std::sqrt(sum_of(before) / total_.records);
    finding.rmse_after_N = std::sqrt(sum_of(after) / total_.records);
    finding.drop_interval = drop_interval(before, after);
    const std::vector<Member> rest = without(members, i);
    const double rest_square = mean_square(rest);
    finding.paired_z = paired_z(block_errors(rest), full_errors);
    finding.wald_z = wald(with(rest, members[i]));
    const std::size_t p = grams_.candidates[k].info.linear.size();
    for (std::size_t c = 0; c < p; ++c, ++at) {
      const double value = full.coefficients[at];
      const double half = kQuantile90 * std::sqrt(std::max(0.0, full.covariance(at, at)));
      finding.coefficients.push_back(value);
      finding.intervals.emplace_back(value - half, value + half);
      finding.model_form.emplace_back(value, value);
    }
    for (int q = 0; q < static_cast<int>(grams_.candidates.size()); ++q) {
      const bool present =
          std::any_of(members.begin(), members.end(), [q](const Member& m) { return m.candidate == q; });
      if (present) continue;
      const Member rival = best_theta(rest, q);
      const std::vector<Member> instead = with(rest, rival);
      const bool explains = rest_square - mean_square(instead) > 0.5 * (rest_square - full_square);
      if (explains && paired_z(block_errors(instead), full_errors) < 2)
        finding.confounded_with.push_back(grams_.candidates[static_cast<std::size_t>(q)].name);
      const Fit beside = fit(with(with(rest, rival), members[i]));
      for (std::size_t c = 0; c < p; ++c) {
        const double value =
            beside.coefficients[beside.coefficients.size() - static_cast<Eigen::Index>(p - c)];
        finding.model_form[c].first = std::min(finding.model_form[c].first, value);
        finding.model_form[c].second = std::max(finding.model_form[c].second, value);
      }
    }
    result.push_back(std::move(finding));
  }
  return result;
}

std::vector<Detectable> Selection::detectable(const std::vector<Member>& members) const {
  constexpr double kPower90 = 1.2816;  // 90 % of the normal distribution
  const std::vector<int> selected = columns(members);
  const double square_sum = mean_square(members) * total_.records;
  const Fit base = members.empty() ? Fit{} : fit(members);
  const Eigen::MatrixXd gram = sub_gram(total_.gram, selected);
  std::vector<Detectable> result;
  for (std::size_t k = 0; k < grams_.candidates.size(); ++k) {
    const stability::EffectInfo& info = grams_.candidates[k].info;
    const bool present = std::any_of(members.begin(), members.end(),
                                     [k](const Member& m) { return m.candidate == static_cast<int>(k); });
    if (present) continue;
    const std::size_t thetas = grams_.candidates[k].thetas.size();
    for (std::size_t c = 0; c < info.linear.size(); ++c) {
      Detectable entry{info.name, info.linear[c].name, kInfinity, info.excitation};
      for (std::size_t t = 0; t < thetas; ++t) {
        const Support& support = grams_.support[k][t];
        if (support.records < thresholds_.support_records || support.blocks < thresholds_.support_blocks)
          continue;
        const int column = grams_.first_column[k][t] + static_cast<int>(c);
        // What of the column the selected effects do not already explain.
        Eigen::VectorXd projection(static_cast<Eigen::Index>(selected.size()));
        Eigen::VectorXd cross = projection;
        for (std::size_t i = 0; i < selected.size(); ++i)
          cross[static_cast<Eigen::Index>(i)] = total_.gram[Grams::packed(selected[i], column)];
        const double own = total_.gram[Grams::packed(column, column)];
        if (!selected.empty()) projection = gram.ldlt().solve(cross);
        const double energy = own - (selected.empty() ? 0 : cross.dot(projection));
        if (!(energy > 1e-9 * own)) continue;
        double meat = 0;
        for (const Block& block : grams_.blocks) {
          double score = block.b[column];
          if (!selected.empty()) {
            Eigen::VectorXd mixed(cross.size());
            for (std::size_t i = 0; i < selected.size(); ++i)
              mixed[static_cast<Eigen::Index>(i)] = block.gram[Grams::packed(selected[i], column)];
            const Eigen::MatrixXd block_gram = sub_gram(block.gram, selected);
            score -= mixed.dot(base.coefficients);
            score -= projection.dot(part_of(block.b, selected) - block_gram * base.coefficients);
          }
          meat += score * score;
        }
        const double deviation = std::sqrt(meat) / energy;
        const double by_gain = std::sqrt(thresholds_.gain / (1 - thresholds_.gain) * square_sum / energy);
        const double size =
            std::max(by_gain + kPower90 * deviation, (thresholds_.wald_z + kPower90) * deviation);
        if (info.remembers) {
          // Gain 1 or nothing: the size is the shortest time that shows.
          if (size <= 1 - thresholds_.memory_tolerance / 2) {
            entry.parameter = info.shape[0].name;
            entry.size = std::min(entry.size, grams_.candidates[k].thetas[t][0]);
          }
        } else if (size <= std::max(std::abs(info.linear[c].lower), std::abs(info.linear[c].upper))) {
          entry.size = std::min(entry.size, size);
        }
      }
      result.push_back(std::move(entry));
    }
  }
  return result;
}

}  // namespace swarmcert::identification
