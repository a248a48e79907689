#include "analysis/identification/block_grams.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "analysis/residuals/force_residual.h"
#include "nn/files/parallel.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Cut;
using residuals::Track;

constexpr double kBlock_s = 2;
constexpr double kPurge_s =
    0.15;  ///< at both ends, so that what filters remember does not leak into another fold
constexpr int kFewestRecords = 40;

stability::EffectContext context_of(const residuals::Inputs& inputs, const stability::Model& model) {
  stability::EffectContext context;
  context.kind = model.kind;
  context.kinds = inputs.kinds.names;
  context.path = model.path;
  return context;
}

/// Candidates ready to run along one track.
struct Runner {
  struct Stream {
    std::unique_ptr<stability::ColumnStream> stream;
    const stability::Effect* effect;
    const double* theta;
    int first, columns, index;
  };
  std::vector<std::unique_ptr<stability::Effect>> effects;
  std::vector<Stream> streams;

  Runner(const Grams& grams, const stability::EffectContext& context) {
    int index = 0;
    for (std::size_t k = 0; k < grams.candidates.size(); ++k) {
      const Candidate& candidate = grams.candidates[k];
      effects.push_back(stability::make_effect(candidate.spec, context));
      for (std::size_t t = 0; t < candidate.thetas.size(); ++t) {
        const double* theta = candidate.thetas[t].data();
        streams.push_back({effects.back()->stream(theta), effects.back().get(), theta,
                           grams.first_column[k][t], effects.back()->num_columns(), index++});
      }
    }
  }
};

struct Piece {
  std::vector<Block> blocks;
  std::vector<Support> support;
};

void finish(Eigen::MatrixXd& rows, int count, int purge_from, const std::vector<int>& in_support,
            Piece& piece, int flight) {
  // rows: [3 x records, columns + 1], the residual last
  const int records = purge_from;
  if (records < kFewestRecords) return;
  const auto used = rows.topRows(3 * records);
  const auto columns = static_cast<int>(rows.cols()) - 1;
  const Eigen::MatrixXd x = used.leftCols(columns);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(columns, columns);
  gram.selfadjointView<Eigen::Upper>().rankUpdate(x.transpose());
  Block block;
  block.gram.resize(Eigen::Index(columns) * (columns + 1) / 2);
  for (int j = 0; j < columns; ++j)
    block.gram.segment(Eigen::Index(j) * (j + 1) / 2, j + 1) = gram.col(j).head(j + 1);
  block.b = x.transpose() * used.col(columns);
  block.y = used.col(columns).squaredNorm();
  block.records = records;
  block.flight = flight;
  piece.blocks.push_back(std::move(block));
  for (std::size_t s = 0; s < in_support.size(); ++s) {
    piece.support[s].records += static_cast<std::size_t>(in_support[s]);
    if (20 * in_support[s] >= count) ++piece.support[s].blocks;
  }
}

void add_track(const residuals::Inputs& inputs, const Track& track, const Grams& grams, int flight,
               Piece& piece) {
  const stability::Model& model = *inputs.model_of(track.kind);
  const std::vector<Eigen::Vector3d> r = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  Runner runner(grams, context_of(inputs, model));
  residuals::AccelerometerFilter filter(model.sensor.accelerometer_cutoff_hz, grams.columns);
  Eigen::Matrix3Xd values(3, grams.columns);
  constexpr int kMostRecords = 1024;
  Eigen::MatrixXd rows(3 * kMostRecords, grams.columns + 1);
  std::vector<int> in_support(piece.support.size(), 0);
  std::vector<double> times_s;
  int count = 0;
  double start_s = 0, last_s = -INFINITY;
  const auto close = [&] {
    int kept = count;
    while (kept > 0 && last_s - times_s[static_cast<std::size_t>(kept) - 1] < kPurge_s) --kept;
    finish(rows, count, kept, in_support, piece, flight);
    std::fill(in_support.begin(), in_support.end(), 0);
    times_s.clear();
    count = 0;
  };
  stability::Wrench columns[stability::kMostColumns];
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    if (track.restarts[i] != 0) {
      filter.restart();
      for (const Runner::Stream& stream : runner.streams) stream.stream->restart();
    }
    for (const Runner::Stream& stream : runner.streams) {
      stream.stream->advance(now, columns);
      for (int c = 0; c < stream.columns; ++c) values.col(stream.first + c) = columns[c].force_W_N;
    }
    if (!inputs.rules.published) residuals::as_measured(now, filter, values);
    if (track.cut[i] != Cut::kNone) continue;
    if (now.time_s - last_s > 0.5 || now.time_s - start_s >= kBlock_s || count == kMostRecords) {
      if (count > 0) close();
      start_s = now.time_s;
    }
    last_s = now.time_s;
    if (now.time_s - start_s < kPurge_s) continue;
    for (int axis = 0; axis < 3; ++axis) {
      rows.row(3 * count + axis).head(grams.columns) = values.row(axis);
      rows(3 * count + axis, grams.columns) = r[i][axis];
    }
    for (const Runner::Stream& stream : runner.streams) {
      if (stream.effect->in_support(now, stream.theta)) ++in_support[static_cast<std::size_t>(stream.index)];
    }
    times_s.push_back(now.time_s);
    ++count;
  }
  if (count > 0) close();
}

}  // namespace

Coverage coverage(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                  int jobs) {
  std::vector<Coverage> parts(which.size());
  std::vector<double> squares(which.size(), 0);
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    Coverage& part = parts[k];
    part.range = {INFINITY, -INFINITY};
    std::vector<std::string> problems;
    for (const Track& track : inputs.load(static_cast<std::size_t>(which[k]), problems)) {
      if (track.position_only || track.kind != kind) continue;
      for (std::size_t s = 0; s < track.instants.size(); ++s) {
        if (track.cut[s] != Cut::kNone) continue;
        const stability::Instant& now = track.instants[s];
        part.range.z_min_m = std::min(part.range.z_min_m, now.p_W_m.z());
        part.range.z_max_m = std::max(part.range.z_max_m, now.p_W_m.z());
        part.has_neighbours = part.has_neighbours || now.num_neighbours > 0;
        squares[k] += now.v_W_m_s.squaredNorm();
        ++part.records;
      }
    }
  });
  Coverage all;
  all.range = {INFINITY, -INFINITY};
  double sum = 0;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    all.range.z_min_m = std::min(all.range.z_min_m, parts[k].range.z_min_m);
    all.range.z_max_m = std::max(all.range.z_max_m, parts[k].range.z_max_m);
    all.has_neighbours = all.has_neighbours || parts[k].has_neighbours;
    all.records += parts[k].records;
    sum += squares[k];
  }
  all.speed_rms_m_s = all.records > 0 ? std::sqrt(sum / static_cast<double>(all.records)) : 0;
  return all;
}

bool is_taken(const std::string& name, const stability::Model& model) {
  return stability::effect_info(name).remembers &&
         std::any_of(model.effects.begin(), model.effects.end(),
                     [&](const stability::EffectSpec& effect) { return effect.name == name; });
}

Candidate candidate(const std::string& name, const stability::Model& model, const Coverage& coverage) {
  Candidate result;
  result.name = name;
  result.spec.name = name;
  result.info = stability::effect_info(name);
  result.thetas = stability::make_effect(result.spec, {})->grid(coverage.range);
  for (const stability::EffectSpec& effect : model.effects) {
    if (effect.name != name) continue;
    const stability::EffectValues values = stability::effect_values(result.info, effect);
    result.thetas = {values.shape};
    for (std::size_t c = 0; c < values.linear.size(); ++c) {
      result.info.linear[c].lower -= values.linear[c];
      result.info.linear[c].upper -= values.linear[c];
    }
    for (std::size_t i = 0; i < values.shape.size(); ++i) {
      result.info.shape[i].lower = result.info.shape[i].upper = values.shape[i];
      result.info.shape[i].grid.clear();
    }
  }
  return result;
}

std::vector<Candidate> all_candidates(const stability::Model& model, const Coverage& coverage) {
  std::vector<Candidate> all;
  for (const std::string& name : stability::effect_names()) {
    const stability::EffectInfo& info = stability::effect_info(name);
    if (name == "deep_set" || name == "torque_bias" || (info.needs_neighbours && !coverage.has_neighbours))
      continue;
    if (!is_taken(name, model)) all.push_back(candidate(name, model, coverage));
  }
  return all;
}

Grams block_grams(const residuals::Inputs& inputs, const std::string& kind, std::vector<Candidate> candidates,
                  const std::vector<int>& which, int jobs, const residuals::Progress& progress) {
  Grams grams;
  grams.candidates = std::move(candidates);
  std::size_t streams = 0;
  for (const Candidate& candidate : grams.candidates) {
    grams.first_column.emplace_back();
    for (std::size_t t = 0; t < candidate.thetas.size(); ++t) {
      grams.first_column.back().push_back(grams.columns);
      grams.columns += static_cast<int>(candidate.info.linear.size());
    }
    grams.support.emplace_back(candidate.thetas.size());
    streams += candidate.thetas.size();
  }
  std::vector<Piece> pieces(which.size());
  std::atomic<int> done{0};
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    Piece& piece = pieces[static_cast<std::size_t>(i)];
    piece.support.resize(streams);
    const int flight = which[static_cast<std::size_t>(i)];
    std::vector<std::string> problems;
    for (const Track& track : inputs.load(static_cast<std::size_t>(flight), problems)) {
      if (!track.position_only && track.kind == kind) add_track(inputs, track, grams, flight, piece);
    }
    progress(++done, static_cast<int>(which.size()));
  });
  for (Piece& piece : pieces) {
    for (Block& block : piece.blocks) grams.blocks.push_back(std::move(block));
    std::size_t index = 0;
    for (auto& thetas : grams.support) {
      for (Support& support : thetas) {
        support.records += piece.support[index].records;
        support.blocks += piece.support[index++].blocks;
      }
    }
  }
  return grams;
}

}  // namespace swarmcert::identification
