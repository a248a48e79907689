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
      std::size_t end = i + 1;  // of a run of columns that lie side by side
      while (end <= j && source[end] == source[end - 1] + 1 && source[end] <= source[j]) ++end;
      std::copy(column + source[i], column + source[end - 1] + 1, to + i);
      i = end;
    }
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

/// Columns of the block, of which those after the kept ones are in `more`. @param source which; -1: zero
void assemble(const KeptBlock& kept, const Eigen::MatrixXd& more, const std::vector<int>& source,
              Eigen::Ref<Eigen::MatrixXd> columns) {
  const int known = kept.columns();
  for (std::size_t j = 0; j < source.size(); ++j) {
    auto to = columns.col(static_cast<Eigen::Index>(j));
    if (source[j] >= known)
      to = more.col(source[j] - known);
    else if (source[j] >= 0)
      to = kept_column(kept, source[j]);
    else
      to.setZero();
  }
}

/// gathered(), likewise.
Block condensed_from(const KeptBlock& kept, const Eigen::MatrixXd& more, const std::vector<int>& source) {
  const auto n = static_cast<Eigen::Index>(source.size());
  Eigen::MatrixXd rows(kept.r.size(), n + 1);
  assemble(kept, more, source, rows.leftCols(n));
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

/// What is asked for, by candidate and theta, in the order of Grams::support.
struct ColumnMemory::Request {
  /// An effect with one theta whose columns are not kept.
  struct More {
    std::string key;
    int columns;
    bool is_new;     ///< to be made in this pass
    Recent* recent;  ///< where they are, or are to be; null: nowhere
  };
  std::vector<std::string> keys;
  std::vector<int> first;  ///< column among the kept ones, followed by those of `more`
  std::vector<More> more;
  int more_columns = 0;
  Grams fresh;  ///< what is new, in the order of `more`
  bool keeps = false;

  /// Column among the kept ones and `more` by column of `asked`; -1: zero.
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
      more.recent->flights.resize(flights_.size());
    }
    if (more.recent != nullptr) more.recent->last_use = requests_;
  }
  return request;
}

void ColumnMemory::forget_old() {
  int columns = 0;
  for (const auto& [key, recent] : recent_) columns += recent.columns;
  while (bytes_of(columns) > kMostRecent_bytes) {
    const auto oldest = std::min_element(recent_.begin(), recent_.end(), [](const auto& a, const auto& b) {
      return a.second.last_use < b.second.last_use;
    });
    columns -= oldest->second.columns;
    recent_.erase(oldest);
  }
}

void ColumnMemory::forget_kept() {
  first_column_.clear();
  columns_ = 0;
  for (Flight& flight : flights_) {
    for (KeptTrack& track : flight.tracks) {
      track.support.clear();
      for (KeptBlock& block : track.blocks)
        block = {{}, std::move(block.r), block.y, block.residual_sum_N, {}, {}, {}};
    }
  }
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

std::vector<Eigen::MatrixXd> ColumnMemory::more_columns(const Passes& passes, const Request& request,
                                                        Along along, const Place& at, KeptTrack& track,
                                                        std::map<std::string, Support>& support) const {
  std::vector<Eigen::MatrixXd> made(track.blocks.size());
  std::vector<Support> made_support(request.more.size());
  if (request.fresh.columns > 0 && along == Along::kFlown) {
    run_blocks(passes.inputs, track.known, request.fresh, nullptr, made_support,
               [&](int block, const Eigen::MatrixXd& rows) {
                 made[static_cast<std::size_t>(block)] = rows.leftCols(request.fresh.columns);
               });
  } else if (request.fresh.columns > 0) {
    made = block_columns(passes.inputs, track.known, request.fresh, track.wanted);
  }
  std::vector<Eigen::MatrixXd> result(track.blocks.size());
  const bool is_all = request.fresh.columns == request.more_columns;
  for (std::size_t b = 0; b < result.size() && !is_all; ++b)
    result[b].resize(track.blocks[b].r.size(), request.more_columns);
  Eigen::Index from = 0, to = 0;
  auto shown = made_support.begin();
  for (const Request::More& more : request.more) {
    TrackColumns* const place =
        more.recent != nullptr ? &more.recent->flights[at.flight].at(at.track) : nullptr;
    for (std::size_t b = 0; b < result.size() && more.is_new && place != nullptr; ++b)
      place->blocks.emplace_back(made[b].middleCols(from, more.columns));
    for (std::size_t b = 0; b < result.size() && !is_all; ++b)
      result[b].middleCols(to, more.columns) =
          more.is_new ? made[b].middleCols(from, more.columns) : place->blocks[b].leftCols(more.columns);
    if (more.is_new && place != nullptr) place->support = *shown;
    support[more.key] = more.is_new ? *shown++ : place->support;
    if (more.is_new) from += more.columns;
    to += more.columns;
  }
  return is_all ? made : result;
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
  std::vector<Eigen::MatrixXd> more = more_columns(passes, request, Along::kFlown, at, track, support);
  const std::vector<int> source = request.sources(asked, track.known.track.vehicle);
  const int number = part.tracks++;
  for (std::size_t b = 0; b < track.blocks.size(); ++b) {
    KeptBlock& kept = track.blocks[b];
    if (request.keeps && request.more_columns > 0) append(std::move(more[b]), kept);
    const bool has_all = request.keeps || request.more_columns == 0;
    part.blocks.push_back(has_all ? gathered(kept, source) : condensed_from(kept, more[b], source));
    Block& block = part.blocks.back();
    block.flight = passes.flights[at.flight];
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
  const auto columns = [&](const Request& request, Along along, const Place& at, KeptTrack& track) {
    std::map<std::string, Support> support;
    const std::vector<Eigen::MatrixXd> more = more_columns(passes, request, along, at, track, support);
    const std::vector<int> source = request.sources(asked, track.known.track.vehicle);
    std::vector<Eigen::MatrixXd> blocks;
    for (std::size_t b = 0; b < more.size(); ++b) {
      blocks.emplace_back(track.blocks[b].r.size(), asked.columns);
      assemble(track.blocks[b], more[b], source, blocks.back());
    }
    return blocks;
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
