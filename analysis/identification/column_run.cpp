#include "analysis/identification/column_run.h"

#include <algorithm>
#include <cmath>

#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

constexpr double kBlock_s = 2, kPurge_s = 0.15, kLongestPause_s = 0.5;
constexpr double kLeastCovered_s = 0.395;  // 0.4 s, with some jitter
constexpr std::size_t kAtOnce = 32;        ///< records per call to an effect

}  // namespace

struct ColumnRun::Stream {
  std::unique_ptr<stability::ColumnStream> stream;
  const stability::Effect* effect;
  const double* theta;
  int first, columns;
  double scale;
  std::size_t index;  ///< among candidates and thetas
};

ColumnRun::ColumnRun(const Grams& grams, const residuals::Inputs& inputs, const stability::Model& model,
                     const residuals::Track& track)
    : filtered_(!inputs.rules.has_published_signals()),
      restarts_(track.restarts),
      measured_(track, model, grams.columns),
      values_(kAtOnce, Eigen::Matrix3Xd::Zero(3, grams.columns)) {
  stability::EffectContext context;
  context.kind = model.kind;
  context.kinds = inputs.kinds.names;
  context.path = model.path;
  std::size_t index = 0;
  for (std::size_t k = 0; k < grams.candidates.size(); ++k) {
    const Candidate& candidate = grams.candidates[k];
    const auto own = std::find(candidate.vehicles.begin(), candidate.vehicles.end(), track.vehicle);
    if (!candidate.vehicles.empty() && own == candidate.vehicles.end()) {
      index += candidate.thetas.size();
      continue;
    }
    effects_.push_back(stability::make_effect(candidate.spec, context));
    const stability::Effect& effect = *effects_.back();
    const int offset = static_cast<int>(own - candidate.vehicles.begin()) * effect.num_columns();
    for (std::size_t t = 0; t < candidate.thetas.size(); ++t) {
      const double* theta = candidate.thetas[t].data();
      streams_.push_back({effect.stream(theta), &effect, theta, grams.first_column[k][t] + offset,
                          effect.num_columns(), candidate.scale, index++});
    }
  }
}

ColumnRun::~ColumnRun() = default;

void ColumnRun::restart() {
  measured_.restart();
  for (const Stream& s : streams_) s.stream->restart();
}

void ColumnRun::advance(const stability::Instant* instants, int count) {
  stability::Wrench columns[kAtOnce * stability::kMostColumns];
  for (const Stream& s : streams_) {
    s.stream->advance_along(instants, count, s.columns, columns);
    const stability::Wrench* next = columns;
    for (int i = 0; i < count; ++i) {
      Eigen::Matrix3Xd& values = values_[static_cast<std::size_t>(i)];
      for (int c = 0; c < s.columns; ++c) values.col(s.first + c) = s.scale * (next++)->force_W_N;
    }
  }
  // Columns of candidates of other vehicles are zero and remain zero after the filter.
  for (int i = 0; i < count && filtered_; ++i)
    measured_.apply(instants[i], values_[static_cast<std::size_t>(i)]);
}

void ColumnRun::along(const std::vector<stability::Instant>& instants, const Use& use) {
  for (std::size_t first = 0, end = 0; first < instants.size(); first = end) {
    do {
      ++end;
    } while (end < instants.size() && end - first < kAtOnce && restarts_[end] == 0);
    if (restarts_[first] != 0) restart();
    advance(&instants[first], static_cast<int>(end - first));
    for (std::size_t i = first; i < end; ++i) use(i, values_[i - first]);
  }
}

void ColumnRun::count_support(const stability::Instant& now, std::vector<int>& counts) const {
  for (const Stream& s : streams_) {
    if (s.effect->in_support(now, s.theta)) ++counts[s.index];
  }
}

TrackBlocks cut_into_blocks(const residuals::Track& track) {
  TrackBlocks result;
  result.of_record.assign(track.instants.size(), -1);
  std::vector<std::size_t> members;
  double start_s = 0, last_s = -INFINITY;
  bool follows = false, dropped = true;
  const auto close = [&] {
    if (members.empty()) return;
    std::size_t kept = members.size();
    while (kept > 0 && last_s - track.instants[members[kept - 1]].time_s < kPurge_s) --kept;
    double covered_s = 0;
    for (std::size_t k = 0; k < kept; ++k)
      covered_s +=
          members[k] == 0 ? 0 : track.instants[members[k]].time_s - track.instants[members[k] - 1].time_s;
    if (covered_s >= kLeastCovered_s) {
      for (std::size_t i = 0; i < kept; ++i)
        result.of_record[members[i]] = static_cast<int>(result.blocks.size());
      result.blocks.push_back({static_cast<int>(kept), result.rows(), follows && !dropped});
      dropped = false;
    } else {
      dropped = true;
    }
    members.clear();
  };
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    if (track.cut[i] != residuals::Cut::kNone) continue;
    const double now_s = track.instants[i].time_s;
    if (now_s - last_s > kLongestPause_s || now_s - start_s >= kBlock_s) {
      close();
      follows = now_s - last_s <= kLongestPause_s;
      start_s = now_s;
    }
    last_s = now_s;
    if (now_s - start_s >= kPurge_s) members.push_back(i);
  }
  close();
  return result;
}

}  // namespace swarmcert::identification
