#include "analysis/identification/evidence/hypotheses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "analysis/identification/evidence/flight_columns.h"
#include "analysis/identification/evidence/instruments.h"

namespace swarmcert::evidence {
namespace {

/// Standard deviation of the force of an effect or curve where it acts, in weights, before any flight.
constexpr double kUsual = 0.1;
/// Odds against the form of an effect that varies, over its plain form.
constexpr double kVaries_bits = 7;
/// Effects that are larger than usual, in multiples of it.
constexpr double kLarge = 10;
/// Of a coefficient that is excluded.
constexpr double kNone = 1e-9;

/// Adds squares and fourth powers of the lengths of the effects' forces, by column.
struct Energy {
  explicit Energy(Eigen::Index columns)
      : squares(Eigen::ArrayXd::Zero(columns)), fourths(Eigen::ArrayXd::Zero(columns)) {}

  void add(const TrackColumns& values, const Stretch& stretch) {
    Eigen::ArrayXXd square = Eigen::ArrayXXd::Zero(stretch.count, squares.size());
    for (int axis = 0; axis < 3; ++axis)
      square += values.along(axis)
                    .block(stretch.first, 0, stretch.count, squares.size())
                    .array()
                    .square()
                    .cast<double>();
    squares += square.colwise().sum().transpose();
    fourths += square.square().colwise().sum().transpose();
  }
  /// Root mean square of the force, weighted with its square: its size where it acts.
  double force_where_it_acts(Eigen::Index column) const {
    return squares[column] > 0 ? std::sqrt(fourths[column] / squares[column]) : 0;
  }

  Eigen::ArrayXd squares, fourths;
};

/// Returns the sets of coefficients that may act: of up to three any of them, as a wind need not have all components.
std::vector<unsigned> acting(int size) {
  const unsigned all = (1U << std::min(size, 31)) - 1;
  if (size > 3) return {all};
  std::vector<unsigned> sets;
  for (unsigned set = 1; set <= all; ++set) sets.push_back(set);
  return sets;
}

std::vector<Prior> priors_of(const Eigen::VectorXd& deviation, const Eigen::VectorXd& sign) {
  std::vector<Prior> priors;
  for (const double scale : {1.0, kLarge}) {
    for (const unsigned set : acting(static_cast<int>(deviation.size()))) {
      Eigen::VectorXd own = scale * deviation;
      for (Eigen::Index c = 0; c < own.size() && own.size() <= 3; ++c) {
        if ((set >> c & 1U) == 0) own[c] = kNone;
      }
      priors.push_back(
          {Eigen::VectorXd::Zero(own.size()), own.cwiseAbs2().cwiseInverse().asDiagonal(), sign});
    }
  }
  return priors;
}

Entry entry_of(const identification::Candidate& candidate, std::vector<int> first_column,
               const Energy& energy, double weight_N) {
  Entry entry;
  entry.name = candidate.name;
  entry.size = candidate.columns();
  entry.first_column = std::move(first_column);
  entry.shapes = entry.first_column.size();
  if (candidate.info.traits.reduces_to != stability::Family::kNone)
    entry.doubt = kVaries_bits * std::log(2.0);
  Eigen::VectorXd deviation(entry.size), sign = Eigen::VectorXd::Zero(entry.size);
  for (int c = 0; c < entry.size; ++c) {
    const stability::Parameter& parameter = candidate.info.linear[static_cast<std::size_t>(c)];
    if (parameter.lower >= 0 && parameter.upper > 0) sign[c] = 1;
    if (parameter.upper <= 0 && parameter.lower < 0) sign[c] = -1;
    double force_N = 0;  // per unit of the coefficient, the largest among the shapes
    for (const int first : entry.first_column)
      force_N = std::max(force_N, energy.force_where_it_acts(first + c));
    const bool is_free = force_N > 0 && !identification::is_held_at_zero(parameter);
    deviation[c] = is_free ? kUsual * weight_N / force_N : kNone;
  }
  if (candidate.info.remembers) {  // the gain of a lag or delay is 1
    const auto n = static_cast<Eigen::Index>(entry.size);
    entry.priors = {{Eigen::VectorXd::Ones(n), Eigen::MatrixXd::Identity(n, n) / (kUsual * kUsual), sign}};
  } else {
    entry.priors = priors_of(deviation, sign);
  }
  return entry;
}

Entry entry_of(const CurveOver& over, int first_column, double weight_N) {
  Entry entry;
  const std::string variable = identification::scan_variable(over.variable).name;
  switch (over.frame) {
    case Frame::kWorld:
      entry.name = fmt::format("force_{} over {}", "xyz"[over.axis], variable);
      break;
    case Frame::kBody:
      entry.name = fmt::format("force_b{} over {}", over.axis + 1, variable);
      break;
    case Frame::kVelocity:
      entry.name = kDragCurve;
      break;
  }
  entry.kind = Kind::kCurve;
  const bool is_across = variable[0] == 'v' && variable.size() == 2 && variable[1] != "xyz"[over.axis];
  if (!is_across) entry.variable = variable;
  entry.size = Curve::kSize;
  entry.first_column = {first_column};
  constexpr double kLevel = 0.05;  // precision of a constant, relative to that of bends
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(entry.size);
  const Eigen::MatrixXd level = kLevel * Eigen::MatrixXd::Identity(entry.size, entry.size);
  for (const double deviation : {0.2 * kUsual, kUsual}) {
    for (const double smoothness : {1.0, 100.0})
      entry.priors.push_back(
          {zero, (level + smoothness * Curve::roughness()) / std::pow(deviation * weight_N, 2), zero});
  }
  return entry;
}

/// Returns the entry of a force that turns with the body: that of a biased accelerometer, or of a tilted thrust axis.
Entry entry_of_body(int first_column, double weight_N) {
  Entry entry;
  entry.name = "constant force of the body";
  entry.variable = "heading";
  entry.kind = Kind::kCurve;
  entry.size = 3;
  entry.first_column = {first_column, first_column + 3};
  entry.shapes = entry.first_column.size();
  entry.priors = priors_of(Eigen::Vector3d::Constant(kUsual * weight_N), Eigen::Vector3d::Zero());
  return entry;
}

/// Writes the transforms of the first columns of a track.
void transform(const TrackColumns& values, const PlacedTrack& placed, const Spectral& spectral,
               Columns& columns) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::MatrixXf& series = values.along(static_cast<int>(axis));
    for (std::size_t s = 0; s < placed.stretches.size(); ++s) {
      const int first = placed.stretches[s].first;
      for (Eigen::Index c = 0; c < columns[axis].cols(); ++c) {
        if (!series.col(c).isZero())
          spectral.transform(placed.first_stretch + s, &series(first, c), columns[axis].col(c).data());
      }
    }
  }
}

void transform_residual(const TrackColumns& values, const PlacedTrack& placed, Hypotheses& result) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::MatrixXf& series = values.along(static_cast<int>(axis));
    for (std::size_t s = 0; s < placed.stretches.size(); ++s)
      result.spectral.transform(placed.first_stretch + s,
                                &series(placed.stretches[s].first, series.cols() - 1),
                                result.residual_N[axis].data());
  }
}

/// Calls use(modelled, placed) for each track.
template <typename Use>
void over_placed_tracks(const identification::Passes& passes, const Survey& surveyed, const Use& use) {
  std::vector<std::size_t> next(passes.flights.size(), 0);  // track of each flight
  over_modelled_tracks(passes, [&](std::size_t k, const identification::ModelledTrack& modelled) {
    use(modelled, surveyed.tracks[k][next[k]++]);
  });
}

}  // namespace

const Prior& Hypotheses::prior_of(const Item& item) const { return entries[item.entry].priors[item.prior]; }

double Hypotheses::log_prior(const Item& item) const {
  const Entry& entry = entries[item.entry];
  const auto alike = std::count_if(entries.begin(), entries.end(),
                                   [&](const Entry& other) { return other.kind == entry.kind; });
  return -entry.doubt - std::log(2.0 * static_cast<double>(alike)) -
         std::log(static_cast<double>(entry.shapes * entry.priors.size()));
}

Hypotheses hypotheses(const identification::Passes& passes,
                      const std::vector<identification::Candidate>& candidates) {
  constexpr double kSensor = 0.003;  // of the weight, per record
  const double weight_N = passes.inputs.model_of(passes.kind)->weight_N();
  const Survey surveyed = survey(passes);
  const identification::Grams grams = identification::columns_of(candidates);
  const Spectral spectral(surveyed.stretches);
  const NoiseModel noise(spectral.bands(), Eigen::Vector3d::Constant(std::pow(kSensor * weight_N, 2)));
  const Eigen::Index width = TrackColumns::width(grams, surveyed.curves);
  Hypotheses result{candidates, {}, surveyed, spectral, noise, {}, {}, {}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result.columns[axis].setZero(spectral.rows(), width);
    result.residual_N[axis].setZero(spectral.rows());
  }
  Instruments instruments(spectral, width, surveyed.vehicles);
  Energy energy(width);
  std::mutex mutex;
  over_placed_tracks(
      passes, surveyed, [&](const identification::ModelledTrack& modelled, const PlacedTrack& placed) {
        const TrackColumns values(passes, modelled, grams, surveyed.curves, modelled.track.instants);
        instruments.add(modelled, placed.stretches, placed.first_stretch,
                        wanted_columns(passes, modelled, grams, surveyed.curves));
        transform(values, placed, spectral, result.columns);
        transform_residual(values, placed, result);
        const std::lock_guard<std::mutex> lock(mutex);
        for (const Stretch& stretch : placed.stretches) energy.add(values, stretch);
      });
  for (std::size_t k = 0; k < candidates.size(); ++k)
    result.entries.push_back(entry_of(candidates[k], grams.first_column[k], energy, weight_N));
  int column = grams.columns;
  for (const CurveOver& over : surveyed.curves) {
    result.entries.push_back(entry_of(over, column, weight_N));
    column += Curve::kSize;
  }
  result.entries.push_back(
      entry_of_body(static_cast<int>(TrackColumns::body_column(grams, surveyed.curves)), weight_N));
  result.instruments = instruments.of_axes();
  return result;
}

Columns evaluate(const identification::Passes& passes, const Hypotheses& all,
                 const std::vector<Shape>& shapes) {
  std::vector<identification::Candidate> candidates;
  for (const Shape& shape : shapes) {
    candidates.push_back(all.candidates[shape.entry]);
    candidates.back().thetas = {shape.theta};
  }
  const identification::Grams grams = identification::columns_of(std::move(candidates));
  Columns columns;
  for (Eigen::MatrixXf& axis : columns) axis.setZero(all.spectral.rows(), grams.columns);
  over_placed_tracks(passes, all.surveyed,
                     [&](const identification::ModelledTrack& modelled, const PlacedTrack& placed) {
                       const TrackColumns values(passes, modelled, grams, {}, modelled.track.instants);
                       transform(values, placed, all.spectral, columns);
                     });
  return columns;
}

}  // namespace swarmcert::evidence
