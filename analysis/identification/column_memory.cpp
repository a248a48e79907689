#include "analysis/identification/column_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "analysis/identification/block_rows.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

/// Names an effect with one theta: equal where the columns are.
std::string key_of(const Candidate& candidate, const std::vector<double>& theta) {
  const stability::EffectSpec& spec = candidate.spec;
  std::string key = fmt::format("{}\n{}\n{:a}\n", spec.name, spec.network, candidate.scale);
  for (const auto& [target, formula] : spec.expression.formulas) key += target + '=' + formula + '\n';
  for (const std::string& name : spec.expression.linear) key += name + ' ';
  key += spec.expression.per_neighbour ? "each\n" : "\n";
  for (const auto& [name, value] : spec.parameters) key += fmt::format("{}={:a} ", name, value);
  for (const double value : theta) key += fmt::format("\n{:a}", value);
  return key;
}

/// Coefficients of each vehicle of its own are one column each, zero for the others.
Candidate of_one_vehicle(const Candidate& candidate) {
  Candidate result = candidate;
  if (result.vehicles.empty()) return result;
  result.info.linear.resize(result.info.linear.size() / result.vehicles.size());
  result.vehicles.clear();
  return result;
}

/// The block with columns of its kept ones. @param source which; -1: zero
Block gathered(const KeptBlock& kept, const std::vector<int>& source) {
  const auto n = static_cast<Eigen::Index>(source.size());
  Block block;
  block.gram = Eigen::VectorXd::Zero(n * (n + 1) / 2);
  block.b = Eigen::VectorXd::Zero(n);
  block.sums = Eigen::Matrix3Xd::Zero(3, n + 1);
  Eigen::Index at = 0;
  for (std::size_t j = 0; j < source.size(); ++j) {
    for (std::size_t i = 0; i <= j; ++i, ++at) {
      if (source[i] >= 0 && source[j] >= 0)
        block.gram[at] = kept.gram[static_cast<std::size_t>(Grams::packed(source[i], source[j]))];
    }
    if (source[j] < 0) continue;
    block.b[static_cast<Eigen::Index>(j)] = kept.b[static_cast<std::size_t>(source[j])];
    block.sums.col(static_cast<Eigen::Index>(j)) = kept.sums[static_cast<std::size_t>(source[j])];
  }
  block.sums.col(n) = kept.residual_sum_N;
  block.y = kept.y;
  block.records = static_cast<int>(kept.r.size() / 3);
  return block;
}

/// Column `at` of X.
auto kept_column(const KeptBlock& block, int at) {
  auto piece = block.pieces.begin();
  for (; at >= piece->cols(); ++piece) at -= static_cast<int>(piece->cols());
  return piece->col(at);
}

/// The same, where columns after the kept ones are those of `fresh`.
Block condensed_from(const KeptBlock& kept, const Eigen::MatrixXd& fresh, const std::vector<int>& source) {
  const auto n = static_cast<Eigen::Index>(source.size());
  const int known = kept.columns();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(kept.r.size(), n + 1);
  for (Eigen::Index j = 0; j < n; ++j) {
    const int from = source[static_cast<std::size_t>(j)];
    if (from >= known)
      rows.col(j) = fresh.col(from - known);
    else if (from >= 0)
      rows.col(j) = kept_column(kept, from);
  }
  rows.col(n) = kept.r;
  return condensed(rows);
}

std::vector<KeptBlock> blocks_without_columns(const ModelledTrack& known) {
  std::vector<KeptBlock> blocks;
  for (const TrackBlock& block : known.cut.blocks) {
    blocks.emplace_back();
    blocks.back().r.resize(Eigen::Index(3) * block.records);
  }
  std::vector<Eigen::Index> count(blocks.size(), 0);
  for (std::size_t i = 0; i < known.residual_N.size(); ++i) {
    if (known.cut.of_record[i] < 0) continue;
    const auto b = static_cast<std::size_t>(known.cut.of_record[i]);
    blocks[b].r.segment<3>(3 * count[b]++) = known.residual_N[i];
    blocks[b].residual_sum_N += known.residual_N[i];
  }
  for (KeptBlock& block : blocks) block.y = block.r.squaredNorm();
  return blocks;
}

void append(Eigen::MatrixXd fresh, KeptBlock& block) {
  const Eigen::Index known = block.columns(), more = fresh.cols();
  Eigen::MatrixXd products(known + more, more);
  Eigen::Index at = 0;
  for (const Eigen::MatrixXd& piece : block.pieces) {
    products.middleRows(at, piece.cols()).noalias() = piece.transpose() * fresh;
    at += piece.cols();
  }
  products.bottomRows(more).noalias() = fresh.transpose() * fresh;
  const Eigen::VectorXd b = fresh.transpose() * block.r;
  for (Eigen::Index j = 0; j < more; ++j) {
    const double* const column = products.col(j).data();
    block.gram.insert(block.gram.end(), column, column + known + j + 1);
    block.b.push_back(b[j]);
    block.sums.emplace_back(fresh.col(j).reshaped(3, fresh.rows() / 3).rowwise().sum());
  }
  block.pieces.push_back(std::move(fresh));
}

}  // namespace

/// What is asked for, by candidate and theta, in the order of Grams::support.
struct ColumnMemory::Request {
  std::vector<std::string> keys;
  std::vector<int> first;               ///< column among the kept ones, followed by the fresh ones
  Grams fresh;                          ///< what is to be made
  std::map<std::string, int> of_fresh;  ///< first column of each, likewise
  std::vector<std::string> fresh_keys;  ///< in the order of fresh.support
  bool keeps = false;

  /// Column among the kept and fresh ones by column of `asked`; -1: zero.
  std::vector<int> sources(const Grams& asked, const std::string& vehicle) const {
    std::vector<int> source(static_cast<std::size_t>(asked.columns), -1);
    std::size_t stream = 0;
    for (std::size_t k = 0; k < asked.candidates.size(); ++k) {
      const Candidate& candidate = asked.candidates[k];
      const std::vector<std::string>& vehicles = candidate.vehicles;
      const auto own = std::find(vehicles.begin(), vehicles.end(), vehicle);
      const bool is_other = !vehicles.empty() && own == vehicles.end();
      const int width = candidate.columns() / std::max(1, static_cast<int>(vehicles.size()));
      for (const int column : asked.first_column[k]) {
        const int from = first[stream++];
        for (int c = 0; c < width && !is_other; ++c)
          source[static_cast<std::size_t>(column + static_cast<int>(own - vehicles.begin()) * width + c)] =
              from + c;
      }
    }
    return source;
  }
};

ColumnMemory::Request ColumnMemory::planned(const Grams& asked, Kept kept) const {
  Request request;
  std::vector<Candidate> fresh;
  int next = columns_;
  for (const Candidate& candidate : asked.candidates) {
    Candidate missing = of_one_vehicle(candidate);
    missing.thetas.clear();
    for (const std::vector<double>& theta : candidate.thetas) {
      request.keys.push_back(key_of(candidate, theta));
      const std::string& key = request.keys.back();
      const auto known = first_column_.find(key);
      if (known != first_column_.end()) {
        request.first.push_back(known->second);
        continue;
      }
      const auto [place, is_new] = request.of_fresh.emplace(key, next);
      request.first.push_back(place->second);
      if (!is_new) continue;
      missing.thetas.push_back(theta);
      request.fresh_keys.push_back(key);
      next += missing.columns();
    }
    if (!missing.thetas.empty()) fresh.push_back(std::move(missing));
  }
  request.fresh = columns_of(std::move(fresh));
  const std::size_t bytes = 3 * sizeof(double) * records_ * static_cast<std::size_t>(next);
  request.keeps = kept == Kept::kYes && bytes <= most_bytes_;
  return request;
}

std::vector<KeptTrack>& ColumnMemory::tracks(const Passes& passes, std::size_t flight) {
  Flight& known = flights_[flight];
  if (known.is_loaded) return known.tracks;
  for (ModelledTrack& track : modelled_tracks(passes.inputs, passes.kind, passes.flights[flight])) {
    known.tracks.emplace_back();
    known.tracks.back().known = std::move(track);
    known.tracks.back().blocks = blocks_without_columns(known.tracks.back().known);
  }
  known.is_loaded = true;
  return known.tracks;
}

void ColumnMemory::add_track(const Passes& passes, const Grams& asked, const Request& request, int flight,
                             KeptTrack& track, FlightPart& part) const {
  std::vector<Eigen::MatrixXd> fresh(track.blocks.size());
  std::vector<Support> fresh_support(request.fresh_keys.size());
  if (request.fresh.columns > 0) {
    run_blocks(passes.inputs, track.known, request.fresh, nullptr, fresh_support,
               [&](int block, const Eigen::MatrixXd& rows) {
                 fresh[static_cast<std::size_t>(block)] = rows.leftCols(request.fresh.columns);
               });
  }
  std::map<std::string, Support> support;
  for (std::size_t s = 0; s < fresh_support.size(); ++s) support[request.fresh_keys[s]] = fresh_support[s];
  const std::vector<int> source = request.sources(asked, track.known.track.vehicle);
  const int number = part.tracks++;
  for (std::size_t b = 0; b < track.blocks.size(); ++b) {
    KeptBlock& kept = track.blocks[b];
    if (request.keeps && request.fresh.columns > 0) append(std::move(fresh[b]), kept);
    const bool has_all = request.keeps || request.fresh.columns == 0;
    part.blocks.push_back(has_all ? gathered(kept, source) : condensed_from(kept, fresh[b], source));
    Block& block = part.blocks.back();
    block.flight = flight;
    block.track = number;
    block.follows = track.known.cut.blocks[b].follows;
  }
  std::size_t stream = 0;
  for (const Candidate& candidate : asked.candidates) {
    const std::vector<std::string>& own = candidate.vehicles;
    const bool acts =
        own.empty() || std::find(own.begin(), own.end(), track.known.track.vehicle) != own.end();
    for (std::size_t t = 0; t < candidate.thetas.size(); ++t, ++stream) {
      if (!acts) continue;
      const auto made = support.find(request.keys[stream]);
      const Support& shown = made != support.end() ? made->second : track.support.at(request.keys[stream]);
      part.support[stream].records += shown.records;
      part.support[stream].blocks += shown.blocks;
    }
  }
  if (request.keeps) track.support.merge(support);
}

Grams ColumnMemory::grams(const Passes& passes, std::vector<Candidate> candidates, Kept kept) {
  const Grams asked = columns_of(std::move(candidates));
  const Request request = planned(asked, kept);
  std::vector<FlightPart> parts(flights_.size(), FlightPart(asked));
  std::atomic<int> done{0};
  files::parallel_for(static_cast<int>(parts.size()), passes.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    for (KeptTrack& track : tracks(passes, k))
      add_track(passes, asked, request, passes.flights[k], track, parts[k]);
    passes.progress(++done, static_cast<int>(parts.size()));
  });
  if (request.keeps) {
    first_column_.insert(request.of_fresh.begin(), request.of_fresh.end());
    columns_ += request.fresh.columns;
  }
  return joined(asked, std::move(parts));
}

}  // namespace swarmcert::identification
