#include "analysis/identification/column_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <utility>

#include "analysis/identification/block_rows.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

/// Returns a key of an effect with one theta: equal keys have equal columns.
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

/// Returns the candidate for one vehicle: each of its own coefficients becomes one column, zero for the other vehicles.
Candidate of_one_vehicle(const Candidate& candidate) {
  Candidate result = candidate;
  if (result.vehicles.empty()) return result;
  result.info.linear.resize(result.info.linear.size() / result.vehicles.size());
  result.vehicles.clear();
  return result;
}

/// Returns the block with columns taken from the kept ones, without the number of its records.
/// @param source index of the kept column; -1: zero
Block gathered(const KeptBlock& kept, const std::vector<int>& source) {
  const auto n = static_cast<Eigen::Index>(source.size());
  Block block;
  block.gram = Eigen::VectorXd::Zero(n * (n + 1) / 2);
  block.b = Eigen::VectorXd::Zero(n);
  double* to = block.gram.data();
  for (std::size_t j = 0; j < source.size(); to += ++j) {
    if (source[j] < 0) continue;
    const double* const column = kept.gram.data() + Grams::packed(0, source[j]);
    for (std::size_t i = 0; i <= j;) {
      if (source[i] < 0 || source[i] > source[j]) {
        if (source[i] >= 0) to[i] = kept.gram[static_cast<std::size_t>(Grams::packed(source[i], source[j]))];
        ++i;
        continue;
      }
      std::size_t end = i + 1;  // of a run of consecutive columns
      while (end <= j && source[end] == source[end - 1] + 1 && source[end] <= source[j]) ++end;
      std::copy(column + source[i], column + source[end - 1] + 1, to + i);
      i = end;
    }
    block.b[static_cast<Eigen::Index>(j)] = kept.b[static_cast<std::size_t>(source[j])];
  }
  block.y = kept.y;
  return block;
}

/// Copies columns into a matrix.
/// @param source index of the column; -1: zero
Eigen::MatrixXd assembled(Eigen::Index rows, const std::vector<const double*>& columns,
                          const std::vector<int>& source) {
  Eigen::MatrixXd result(rows, static_cast<Eigen::Index>(source.size()));
  double* to = result.data();
  for (const int from : source) {
    if (from < 0)
      std::fill(to, to + rows, 0.0);
    else
      std::copy(columns[static_cast<std::size_t>(from)], columns[static_cast<std::size_t>(from)] + rows, to);
    to += rows;
  }
  return result;
}

KeptTrack kept_track(ModelledTrack track) {
  KeptTrack kept;
  kept.residual_N = residual_along(track);
  for (const TrackBlock& block : track.cut.blocks) {
    const Eigen::VectorXd r = kept.residual_N.segment(block.first_row, Eigen::Index(3) * block.records);
    kept.blocks.emplace_back();
    kept.blocks.back().y = r.squaredNorm();
  }
  kept.known = std::move(track);
  return kept;
}

/// Keeps further columns.
/// @param fresh columns_along() the track
void append(Eigen::MatrixXd fresh, KeptTrack& track) {
  const Eigen::Index more = fresh.cols();
  for (std::size_t at = 0; at < track.blocks.size(); ++at) {
    const TrackBlock& cut = track.known.cut.blocks[at];
    KeptBlock& block = track.blocks[at];
    const Eigen::Index first = cut.first_row, rows = Eigen::Index(3) * cut.records;
    const auto of_block = [&](const Eigen::MatrixXd& columns) { return columns.middleRows(first, rows); };
    const auto x = of_block(fresh);
    const auto known = static_cast<Eigen::Index>(block.b.size());
    Eigen::MatrixXd products(known + more, more);
    Eigen::Index row = 0;
    for (const Eigen::MatrixXd& piece : track.pieces) {
      products.middleRows(row, piece.cols()).noalias() = of_block(piece).transpose() * x;
      row += piece.cols();
    }
    products.bottomRows(more).noalias() = x.transpose() * x;
    const Eigen::VectorXd b = x.transpose() * track.residual_N.segment(first, rows);
    for (Eigen::Index j = 0; j < more; ++j) {
      const double* const column = products.col(j).data();
      block.gram.insert(block.gram.end(), column, column + known + j + 1);
      block.b.push_back(b[j]);
    }
  }
  track.pieces.push_back(std::move(fresh));
}

}  // namespace

std::string text_of(const std::vector<Candidate>& candidates) {
  std::string text;
  for (const Candidate& candidate : candidates) {
    text += fmt::format("{} {}\n", candidate.name, candidate.refined_thetas);
    for (const std::string& vehicle : candidate.vehicles) text += vehicle + '\n';
    for (const auto* const parameters : {&candidate.info.linear, &candidate.info.shape}) {
      for (const stability::Parameter& p : *parameters) {
        text += fmt::format("{} {:a} {:a} {:a}:", p.name, p.value, p.lower, p.upper);
        for (const double value : p.grid) text += fmt::format(" {:a}", value);
      }
    }
    for (const std::vector<double>& theta : candidate.thetas) text += key_of(candidate, theta);
  }
  return text;
}

/// The requested columns, by candidate and theta in the order of Grams::support.
struct ColumnMemory::Request {
  /// An effect with one theta whose columns are not kept.
  struct More {
    std::string key;
    int columns;
    bool is_new;     ///< to be computed in this pass
    Recent* recent;  ///< where they are or will be stored; null: nowhere
  };
  std::vector<std::string> keys;
  std::vector<int> first;  ///< index among the kept columns, followed by those of `more`
  std::vector<More> more;
  int more_columns = 0;
  Grams fresh;  ///< new columns, in the order of `more`
  bool keeps = false;

  /// Returns the index among the kept columns and `more` for each column of `asked`; -1: zero.
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

std::size_t ColumnMemory::bytes_of(int columns) const {
  return 3 * sizeof(double) * records_ * static_cast<std::size_t>(columns);
}

ColumnMemory::Request ColumnMemory::planned(const Grams& asked, Kept kept, Along along) {
  Request request;
  std::vector<Candidate> fresh;
  std::map<std::string, int> first;
  ++requests_;
  for (const Candidate& candidate : asked.candidates) {
    Candidate missing = of_one_vehicle(candidate);
    missing.thetas.clear();
    for (const std::vector<double>& theta : candidate.thetas) {
      const std::string key = (along == Along::kWanted ? "wanted " : "") + key_of(candidate, theta);
      request.keys.push_back(key);
      const auto known = first_column_.find(key);
      if (known != first_column_.end()) {
        request.first.push_back(known->second);
        continue;
      }
      const auto [place, is_other] = first.emplace(key, columns_ + request.more_columns);
      request.first.push_back(place->second);
      if (!is_other) continue;
      const auto recent = recent_.find(key);
      const bool is_new = recent == recent_.end();
      request.more.push_back({key, missing.columns(), is_new, is_new ? nullptr : &recent->second});
      if (is_new) missing.thetas.push_back(theta);
      request.more_columns += missing.columns();
    }
    if (!missing.thetas.empty()) fresh.push_back(std::move(missing));
  }
  request.fresh = columns_of(std::move(fresh));
  request.keeps = kept == Kept::kYes && bytes_of(columns_ + request.more_columns) <= most_bytes_;
  const bool are_recent = !request.keeps && bytes_of(request.fresh.columns) <= kMostRecent_bytes;
  for (Request::More& more : request.more) {
    if (more.is_new && are_recent) {
      more.recent = &recent_[more.key];
      more.recent->columns = more.columns;
      if (const auto spare = spare_.find(more.columns); spare != spare_.end()) {
        more.recent->flights = std::move(spare->second);
        spare_.erase(spare);
      }
      more.recent->flights.resize(flights_.size());
    }
    if (more.recent != nullptr) more.recent->last_use = requests_;
  }
  return request;
}

void ColumnMemory::forget_old() {
  int columns = 0;
  for (const auto& [key, recent] : recent_) columns += recent.columns;
  spare_.clear();
  while (bytes_of(columns) > kMostRecent_bytes) {
    const auto oldest = std::min_element(recent_.begin(), recent_.end(), [](const auto& a, const auto& b) {
      return a.second.last_use < b.second.last_use;
    });
    columns -= oldest->second.columns;
    spare_.emplace(oldest->second.columns, std::move(oldest->second.flights));
    recent_.erase(oldest);
  }
}

void ColumnMemory::forget_kept() {
  spare_.clear();
  first_column_.clear();
  columns_ = 0;
  for (Flight& flight : flights_) {
    for (KeptTrack& track : flight.tracks) {
      track.support.clear();
      track.pieces = {};
      for (KeptBlock& block : track.blocks) block = {block.y, {}, {}};
    }
  }
}

std::vector<KeptTrack>& ColumnMemory::tracks(const Passes& passes, std::size_t flight) {
  Flight& known = flights_[flight];
  if (known.is_loaded) return known.tracks;
  for (ModelledTrack& track : modelled_tracks(passes.inputs, passes.kind, passes.flights[flight]))
    known.tracks.push_back(kept_track(std::move(track)));
  known.is_loaded = true;
  return known.tracks;
}

std::vector<const double*> ColumnMemory::columns_of_track(const Passes& passes, const Request& request,
                                                          Along along, const Place& at,
                                                          const KeptTrack& track, Eigen::MatrixXd& made,
                                                          std::map<std::string, Support>& support) const {
  std::vector<Support> made_support(request.more.size());
  if (request.fresh.columns > 0) {
    made = along == Along::kFlown ? columns_along(passes.inputs, track.known, request.fresh,
                                                  track.known.track.instants, &made_support)
                                  : columns_along(passes.inputs, track.known, request.fresh, track.wanted);
  }
  std::vector<const double*> columns;
  const auto add = [&](const Eigen::MatrixXd& rows, Eigen::Index first, Eigen::Index count) {
    for (Eigen::Index c = first; c < first + count; ++c) columns.push_back(rows.col(c).data());
  };
  for (const Eigen::MatrixXd& piece : track.pieces) add(piece, 0, piece.cols());
  Eigen::Index from = 0;
  auto shown = made_support.begin();
  for (const Request::More& more : request.more) {
    TrackColumns* const place =
        more.recent != nullptr ? &more.recent->flights[at.flight].at(at.track) : nullptr;
    if (!more.is_new) {
      add(place->rows, 0, more.columns);
      support[more.key] = place->support;
      continue;
    }
    if (place != nullptr) {
      place->rows = made.middleCols(from, more.columns);
      place->support = *shown;
    }
    add(made, from, more.columns);
    support[more.key] = *shown++;
    from += more.columns;
  }
  return columns;
}

void ColumnMemory::make_places(const Request& request, std::size_t flight) const {
  for (const Request::More& more : request.more) {
    if (more.is_new && more.recent != nullptr)
      more.recent->flights[flight].resize(flights_[flight].tracks.size());
  }
}

void ColumnMemory::add_track(const Passes& passes, const Grams& asked, const Request& request,
                             const Place& at, KeptTrack& track, FlightPart& part) const {
  std::map<std::string, Support> support;
  Eigen::MatrixXd made_rows;
  std::vector<const double*> columns =
      columns_of_track(passes, request, Along::kFlown, at, track, made_rows, support);
  const Eigen::Index length = track.residual_N.size();
  if (request.keeps && request.more_columns > 0) {
    std::vector<int> fresh(static_cast<std::size_t>(request.more_columns));
    std::iota(fresh.begin(), fresh.end(), columns_);
    const bool are_new = request.fresh.columns == request.more_columns;
    append(are_new ? std::move(made_rows) : assembled(length, columns, fresh), track);
  }
  std::vector<int> source = request.sources(asked, track.known.track.vehicle);
  const bool has_all = request.keeps || request.more_columns == 0;
  Eigen::MatrixXd rows;
  if (!has_all) {
    source.push_back(static_cast<int>(columns.size()));
    columns.push_back(track.residual_N.data());
    rows = assembled(length, columns, source);
  }
  for (std::size_t b = 0; b < track.blocks.size(); ++b) {
    const TrackBlock& cut = track.known.cut.blocks[b];
    part.blocks.push_back(has_all ? gathered(track.blocks[b], source)
                                  : condensed(rows.middleRows(cut.first_row, Eigen::Index(3) * cut.records)));
    Block& block = part.blocks.back();
    block.records = cut.records;
    block.flight = passes.flights[at.flight];
    block.follows = cut.follows;
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
  const Request request = planned(asked, kept, Along::kFlown);
  std::vector<FlightPart> parts(flights_.size(), FlightPart(asked));
  std::atomic<int> done{0};
  files::parallel_for(static_cast<int>(parts.size()), passes.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<KeptTrack>& all = tracks(passes, k);
    make_places(request, k);
    for (std::size_t t = 0; t < all.size(); ++t) add_track(passes, asked, request, {k, t}, all[t], parts[k]);
    passes.progress(++done, static_cast<int>(parts.size()));
  });
  if (request.keeps) {
    int next = columns_;
    for (const Request::More& more : request.more) {
      first_column_.emplace(more.key, next);
      next += more.columns;
    }
    columns_ = next;
  }
  forget_old();
  return joined(asked, std::move(parts));
}

void ColumnMemory::over_columns(const Passes& passes, const Grams& asked, const UseColumns& use) {
  const Request flown = planned(asked, Kept::kNo, Along::kFlown);
  const Request wanted = planned(asked, Kept::kNo, Along::kWanted);
  const auto columns = [&](const Request& request, Along along, const Place& at, const KeptTrack& track) {
    std::map<std::string, Support> support;
    Eigen::MatrixXd made;
    const auto all = columns_of_track(passes, request, along, at, track, made, support);
    return assembled(track.residual_N.size(), all, request.sources(asked, track.known.track.vehicle));
  };
  files::parallel_for(static_cast<int>(flights_.size()), passes.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<KeptTrack>& all = tracks(passes, k);
    make_places(flown, k);
    make_places(wanted, k);
    for (std::size_t t = 0; t < all.size(); ++t) {
      KeptTrack& track = all[t];
      if (track.wanted.empty()) track.wanted = as_commanded(track.known.track, track.known.model.mass_kg);
      use(k, track.known, columns(flown, Along::kFlown, {k, t}, track),
          columns(wanted, Along::kWanted, {k, t}, track));
    }
  });
  forget_old();
}

}  // namespace swarmcert::identification
