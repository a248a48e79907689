#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/residual_blocks.h"
#include "analysis/reproduction/stages.h"
#include "analysis/residuals/force_residual.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;

/// Each of the two vehicles above exerts at least this force on its own, according to two-vehicle flights.
constexpr double kActing_gf = 1;
constexpr double kDefectBlock_s = 2;

/// Sums over one block of one vehicle, by the name of the summed quantity.
using Sums = std::map<std::string, BlockMean>;
using Blocks = std::map<std::string, Sums>;

void add(Blocks& blocks, const std::string& block, const std::string& name, double value) {
  BlockMean& mean = blocks[block][name];
  mean.sum += value;
  mean.count += 1;
}

Estimate estimate(const Blocks& blocks, const std::string& name) {
  std::vector<BlockMean> means;
  for (const auto& [block, sums] : blocks) {
    const auto found = sums.find(name);
    if (found != sums.end()) means.push_back(found->second);
  }
  return mean_of(means);
}

struct Defect {
  double together_gf = 0, apart_gf = 0;

  Defect(Interaction& f, const Relative& a, const Relative& b) {
    const double nobody = f.force_z_gf({});
    together_gf = f.force_z_gf({a, b}) - nobody;
    apart_gf = f.force_z_gf({a}) + f.force_z_gf({b}) - 2 * nobody;
  }
};

struct FunctionRow {
  std::string function;
  std::size_t records = 0;
  Estimate together, apart, defect;
};

struct SuperpositionResult {
  std::vector<FunctionRow> rows;
};

void describe(files::Record& record, const SuperpositionResult& result) {
  record.list("rows", result.rows, "One row per function and placement; forces relative to no neighbour.",
              [](files::Record& r, const FunctionRow& row) {
                r.field("function", row.function, "");
                r.field("records", row.records, "");
                r.field("f_ab_gf", row.together.value_gf, "f(a,b).", "gf", "estimate");
                r.field("f_a_plus_f_b_gf", row.apart.value_gf, "f(a) + f(b).", "gf", "estimate");
                r.field("defect_gf", row.defect.value_gf, "f(a,b) - f(a) - f(b).", "gf", "estimate");
                r.field("interval_gf", row.defect.interval, "90 %, of the defect.", "gf", "estimate");
              });
}

FunctionRow row_of(const std::string& function, const Blocks& blocks, const std::string& name,
                   std::size_t records) {
  return {function, records, estimate(blocks, name + " together"), estimate(blocks, name + " apart"),
          estimate(blocks, name + " defect")};
}

/// Simulated flights of three vehicles: the truth and the network at the states reached in flight.
void add_simulated(const Setting& setting, const Truth& truth, SuperpositionResult& result) {
  Stages stages(setting, truth, 0);
  const Learned learned = stages.learned(stage_of(3));
  Interaction actual(truth), predicted(learned.network);
  Blocks blocks;
  std::size_t records = 0;
  for (int flight = 0; flight < (setting.full ? 4 : 1); ++flight) {
    const Flown flown =
        fly(setting, truth,
            {"random-walk", 3, 60, stages.seed("superposition", static_cast<std::uint64_t>(flight))},
            &learned.network, false);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < flown.vehicles[i].size(); ++k) {
        Relative others[2];
        for (std::size_t o = 0; o < 2; ++o) {
          const Moment& own = flown.vehicles[i][k];
          const Moment& other = flown.vehicles[(i + 1 + o) % 3][k];
          for (int c = 0; c < 3; ++c) {
            others[o][static_cast<std::size_t>(c)] = static_cast<double>(other.p_m[c] - own.p_m[c]);
            others[o][static_cast<std::size_t>(c) + 3] = static_cast<double>(other.v_m_s[c] - own.v_m_s[c]);
          }
        }
        if (std::max(actual.force_z_gf({others[0]}), actual.force_z_gf({others[1]})) > -kActing_gf) continue;
        ++records;
        const std::string block =
            fmt::format("{} {} {}", flight, i, std::floor(static_cast<double>(k) / 100 / kDefectBlock_s));
        for (const auto& [name, function] : {std::pair{"truth", &actual}, std::pair{"network", &predicted}}) {
          const Defect defect(*function, others[0], others[1]);
          add(blocks, block, std::string(name) + " together", defect.together_gf);
          add(blocks, block, std::string(name) + " apart", defect.apart_gf);
          add(blocks, block, std::string(name) + " defect", defect.together_gf - defect.apart_gf);
        }
      }
    }
  }
  if (records == 0) return;
  result.rows.push_back(row_of(fmt::format("truth \"{}\"", truth.name), blocks, "truth", records));
  result.rows.push_back(row_of("network trained with 3 on it", blocks, "network", records));
}

/// Recorded flights of three small vehicles: the measured force minus the force of each neighbour according to
/// two-vehicle flights.
void add_recorded(const Setting& setting, const Truth& truth, SuperpositionResult& result, Finding& finding) {
  if (setting.recorded.empty() || !fs::exists(fs::path(setting.recorded) / "flights")) {
    finding.notes.push_back("Recorded flights are left out: --recorded names no folder that contains them.");
    return;
  }
  residuals::InputArguments arguments;
  for (const char* const folder : {"development", "visible_test"}) {
    for (const char* const scenario : {"21_randomwalk_sss", "21_swap_sss"})
      arguments.flights.push_back((fs::path(setting.recorded) / "flights" / folder / scenario).string());
  }
  arguments.fleet = setting.fleet;
  residuals::Inputs inputs = residuals::read_inputs(arguments);
  for (stability::Model& model : inputs.models) model.effects = nominal(truth).effects;
  Interaction pair(truth);
  Blocks blocks;
  std::size_t records = 0;
  for (std::size_t f = 0; f < inputs.found.flights.size(); ++f) {
    for (const auto& [vehicle, path] : inputs.found.flights[f].logs) finding.inputs.push_back(path);
    for (const residuals::Track& track : inputs.load(f, finding.notes)) {
      if (track.position_only) continue;
      const std::vector<Eigen::Vector3d> residual =
          residuals::force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
      // Trim: the remaining force when no vehicle is above.
      BlockMean trim;
      std::vector<std::pair<std::size_t, std::array<Relative, 2>>> acting;
      for (std::size_t k = 0; k < residual.size(); ++k) {
        const stability::Instant& now = track.instants[k];
        if (track.cut[k] != residuals::Cut::kNone || now.num_neighbours != 2) continue;
        std::array<Relative, 2> others;
        double forces[2];
        for (std::size_t o = 0; o < 2; ++o) {
          const stability::Neighbour& other = now.neighbours[o];
          for (int c = 0; c < 3; ++c) {
            others[o][static_cast<std::size_t>(c)] = other.dp_W_m[c];
            others[o][static_cast<std::size_t>(c) + 3] = other.dv_W_m_s[c];
          }
          forces[o] = pair.force_z_gf({others[o]});
        }
        if (std::max(forces[0], forces[1]) < -kActing_gf) acting.emplace_back(k, others);
        if (std::min(forces[0], forces[1]) > -0.05) {
          trim.sum += residual[k].z();
          trim.count += 1;
        }
      }
      if (trim.count < 200) continue;
      for (const auto& [k, others] : acting) {
        const double together = (residual[k].z() - trim.sum / trim.count) / stability::kGramForce_N;
        const double apart = pair.force_z_gf({others[0]}) + pair.force_z_gf({others[1]});
        const std::string block = fmt::format("{} {} {}", track.flight, track.vehicle,
                                              std::floor(track.instants[k].time_s / kDefectBlock_s));
        add(blocks, block, "recorded together", together);
        add(blocks, block, "recorded apart", apart);
        add(blocks, block, "recorded defect", together - apart);
        ++records;
      }
    }
  }
  if (records > 0) result.rows.push_back(row_of("recorded flights of three", blocks, "recorded", records));
}

Finding run_superposition(const Setting& setting) {
  Finding finding;
  SuperpositionResult result;
  for (const Truth& truth : truths(setting)) add_simulated(setting, truth, result);
  Setting recorded = setting;
  recorded.updraft = false;  // the updraft is our assumption: recorded flights of two show none
  add_recorded(recorded, truths(recorded).front(), result, finding);
  finding.fields = files::record_of(result);
  finding.show(fmt::format("Two vehicles above that push by more than {:g} gf each", kActing_gf), "rows",
               {{"function"},
                {"records"},
                {"f_ab_gf", "f(a,b)", "{:.2f}"},
                {"f_a_plus_f_b_gf", "f(a) + f(b)", "{:.2f}"},
                {"defect_gf", "", "{:+.2f}"},
                {"interval_gf", "90 %", "{:+.2f}"}});
  finding.notes.push_back(
      "The defect is f(a,b) - f(a) - f(b), all relative to f of no neighbour. For recorded flights f(a) and "
      "f(b) are the downwash fitted to flights of two vehicles, and f(a,b) is the measured force minus the "
      "vehicle's mean when no vehicle is above. Intervals: 90 %, blocks of 2 s.");
  return finding;
}

}  // namespace

Experiment superposition() {
  return experiment<SuperpositionResult>(
      "superposition", "f(a,b) - f(a) - f(b): truth, network, recorded flights", run_superposition);
}

}  // namespace swarmcert::reproduction
