#include "analysis/logs/assignment.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/logs/motion_evidence.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

constexpr double kLikelyName = 6;    ///< bits of a name that nothing else confirms
constexpr std::size_t kTried = 150;  ///< readings of a file that are compared in full
constexpr double kDown = 8;          ///< bits against z down
constexpr int kNone = -1;

/// Choices for position, velocity, attitude, specific force and rates.
enum Slot : std::size_t { kPositionSlot, kVelocitySlot, kAttitudeSlot, kForceSlot, kRateSlot, kNumSlots };
using Choice = std::array<int, kNumSlots>;

struct Scored {
  Choice choice;
  double bits = 0;
};

bool overlap(const Reading& a, const Reading& b) {
  if (a.carried.topic != b.carried.topic) return false;
  return std::any_of(a.carried.columns.begin(), a.carried.columns.end(), [&](int c) {
    return c >= 0 &&
           std::find(b.carried.columns.begin(), b.carried.columns.end(), c) != b.carried.columns.end();
  });
}

/// Joint search over the readings of the motion.
class MotionSearch {
 public:
  MotionSearch(const RawLog& log, const Knots& knots, std::array<std::vector<Reading>, kNumSlots> readings)
      : log_(log), knots_(knots), readings_(std::move(readings)) {
    for (std::size_t slot = 0; slot < kNumSlots; ++slot) keep_likely(slot);
    add_accelerations();
    score_all();
  }

  /// The best reading of the file; kNone for signals that it does not have.
  const Scored& best() const { return scored_.front(); }
  const Reading& reading(std::size_t slot, int index) const {
    return readings_[slot][static_cast<std::size_t>(index)];
  }

  struct Odds {
    double bits = INFINITY;
    std::string runner_up;
  };
  /// The lead over the best reading of the file in which the signal is another one.
  Odds odds_of(std::size_t slot) const {
    constexpr double kSameKind = kClear_bits;  // two measurements of the vehicle: either is right
    const int chosen = best().choice[slot];
    const Reading& winner = reading(slot, chosen);
    Odds odds;
    for (const Scored& other : scored_) {
      const int index = other.choice[slot];
      double lead = best().bits - other.bits;
      if (index == chosen || lead >= odds.bits + kSameKind) continue;
      if (index != kNone) {
        const Reading& rival = reading(slot, index);
        if (is_same_signal(winner, rival)) continue;
        const bool is_other_group = !overlap(winner, rival);
        if (is_other_group && winner.name_bits > kLikelyName && rival.name_bits > kLikelyName)
          lead += kSameKind;
      }
      if (lead >= odds.bits) continue;
      odds.bits = lead;
      odds.runner_up = index == kNone ? "something else" : words_of(reading(slot, index));
    }
    return odds;
  }

  /// Bits of what holds between the signals, without those of names and ranges.
  double confirmation() const {
    double bits = best().bits;
    for (std::size_t slot = 0; slot < kNumSlots; ++slot)
      if (best().choice[slot] != kNone) bits -= reading(slot, best().choice[slot]).bits;
    return bits;
  }

  /// The lead over the best reading of the file in which the signal is `named`; 0 if that is the best.
  double lead_over(std::size_t slot, const Carried& named) const {
    for (const Scored& other : scored_) {
      const int index = other.choice[slot];
      if (index == kNone || !is_same_reading(reading(slot, index).carried, named)) continue;
      return is_same_signal(reading(slot, best().choice[slot]), reading(slot, index))
                 ? 0
                 : best().bits - other.bits;
    }
    return 0;
  }

 private:
  std::string words_of(const Reading& reading) const {
    return names_of(log_, reading.carried) + ": " + reading.words;
  }

  /// Bounds the search: readings far behind the best of their slot cannot win, those of one file's columns may be many.
  void keep_likely(std::size_t slot) {
    constexpr std::size_t kMost = 120;
    constexpr double kLeast = -45;
    std::vector<Reading>& all = readings_[slot];
    all.erase(std::remove_if(all.begin(), all.end(), [](const Reading& r) { return r.bits < kLeast; }),
              all.end());
    std::stable_sort(all.begin(), all.end(),
                     [](const Reading& a, const Reading& b) { return a.bits > b.bits; });
    if (all.size() > kMost) all.erase(all.begin() + kMost, all.end());
  }

  void add_accelerations() {
    for (const std::size_t slot : {kPositionSlot, kVelocitySlot})
      for (const Reading& motion : readings_[slot])
        accelerations_[slot].push_back(acceleration_of(knots_, motion));
    for (const std::size_t slot : {kPositionSlot, kVelocitySlot}) {
      for (const ThreeSeries& acceleration : accelerations_[slot]) {
        thrust_axis_[slot].emplace_back();
        for (const Reading& attitude : readings_[kAttitudeSlot])
          thrust_axis_[slot].back().push_back(thrust_axis_bits(knots_, acceleration, attitude));
      }
    }
  }

  /// Bits of position, velocity and attitude together.
  double motion_bits(const Choice& c) const {
    double bits = 0;
    for (const std::size_t slot : {kPositionSlot, kVelocitySlot, kAttitudeSlot})
      if (c[slot] != kNone) bits += reading(slot, c[slot]).bits;
    const std::size_t from = motion_slot(c);
    if (c[kAttitudeSlot] == kNone || c[from] == kNone) return bits;
    return bits +
           thrust_axis_[from][static_cast<std::size_t>(c[from])][static_cast<std::size_t>(c[kAttitudeSlot])];
  }

  /// The acceleration is the slope of the velocity or, without one, the curvature of the position.
  static std::size_t motion_slot(const Choice& c) {
    return c[kVelocitySlot] != kNone ? kVelocitySlot : kPositionSlot;
  }
  const ThreeSeries* acceleration(const Choice& c) const {
    const std::size_t from = motion_slot(c);
    return c[from] == kNone ? nullptr : &accelerations_[from][static_cast<std::size_t>(c[from])];
  }

  /// Most people log z up, and rarely mix frames or units.
  double frame_bits(const Choice& c) const {
    constexpr double kMixed = 8;
    const Reading *const position = chosen(c, kPositionSlot), *const velocity = chosen(c, kVelocitySlot),
                         *const attitude = chosen(c, kAttitudeSlot);
    const Reading* const world = velocity != nullptr ? velocity : position;
    const bool is_down = world != nullptr && world->is_down;
    double bits = is_down ? -kDown : 0;
    // Who logs positions in centimetres logs velocities in centimetres per second: one habit, not two.
    const bool is_one_habit = position != nullptr && velocity != nullptr &&
                              velocity->carried.factor.divide > 1 &&
                              position->carried.factor.divide == velocity->carried.factor.divide;
    if (is_one_habit) bits += kOtherUnit;
    if (position != nullptr && position->is_down != is_down) bits -= kMixed;
    if (attitude != nullptr && attitude->is_down != is_down) bits -= kMixed;
    return bits;
  }

  /// Chooses the reading of a slot that adds most, if any adds something.
  void choose_best(std::size_t slot, Scored& scored) const {
    double most = 0;
    for (int i = 0; i < count(slot); ++i) {
      bool is_free = true;
      for (std::size_t other = 0; other < kNumSlots; ++other)
        is_free = is_free && (other == slot || !clash(slot, i, other, scored.choice[other]));
      const double bits =
          is_free ? reading(slot, i).bits + evidence(slot, scored.choice, reading(slot, i)) : 0;
      if (bits <= most) continue;
      most = bits;
      scored.choice[slot] = i;
    }
    scored.bits += most;
  }

  int count(std::size_t slot) const { return static_cast<int>(readings_[slot].size()); }
  bool clash(std::size_t a, int i, std::size_t b, int k) const {
    return i != kNone && k != kNone && overlap(reading(a, i), reading(b, k));
  }

  const Reading* chosen(const Choice& c, std::size_t slot) const {
    return c[slot] == kNone ? nullptr : &reading(slot, c[slot]);
  }

  double force_evidence(const Choice& c, const Reading& force) const {
    const Reading* const attitude = chosen(c, kAttitudeSlot);
    const ThreeSeries* const moves = acceleration(c);
    const double bits = moves != nullptr ? specific_force_bits(knots_, *moves, attitude, force) : 0;
    return bits - (attitude != nullptr && force.is_down != attitude->is_down ? 3 : 0);
  }
  double rate_evidence(const Choice& c, const Reading& rates) const {
    const Reading* const attitude = chosen(c, kAttitudeSlot);
    const ThreeSeries* const moves = acceleration(c);
    const Reading* like = nullptr;
    for (const std::size_t slot : {kForceSlot, kAttitudeSlot, kVelocitySlot, kPositionSlot})
      if (like == nullptr) like = chosen(c, slot);
    const double bits = attitude != nullptr ? rate_bits(knots_, *attitude, rates)
                        : moves != nullptr  ? tilt_rate_bits(knots_, *moves, rates)
                                            : 0;
    const bool is_down = like != nullptr && like->is_down;
    return bits - (rates.is_down == is_down ? 0 : like != nullptr ? 6 : kDown);
  }
  double evidence(std::size_t slot, const Choice& c, const Reading& candidate) const {
    return slot == kForceSlot ? force_evidence(c, candidate) : rate_evidence(c, candidate);
  }

  void score_all() {
    std::vector<Scored> all;
    for (int p = kNone; p < count(kPositionSlot); ++p) {
      for (int v = kNone; v < count(kVelocitySlot); ++v) {
        if (clash(kPositionSlot, p, kVelocitySlot, v)) continue;
        const double of_pair = p == kNone || v == kNone ? 0
                                                        : derivative_bits(knots_, reading(kPositionSlot, p),
                                                                          reading(kVelocitySlot, v));
        for (int a = kNone; a < count(kAttitudeSlot); ++a) {
          const Choice choice = {p, v, a, kNone, kNone};
          if (clash(kAttitudeSlot, a, kPositionSlot, p) || clash(kAttitudeSlot, a, kVelocitySlot, v))
            continue;
          all.push_back({choice, of_pair + motion_bits(choice) + frame_bits(choice)});
        }
      }
    }
    std::sort(all.begin(), all.end(), [](const Scored& a, const Scored& b) { return a.bits > b.bits; });
    keep_contenders(all);
    for (Scored& scored : scored_)
      for (const std::size_t slot : {kForceSlot, kRateSlot}) choose_best(slot, scored);
    std::stable_sort(scored_.begin(), scored_.end(),
                     [](const Scored& a, const Scored& b) { return a.bits > b.bits; });
    add_variants();
  }

  /// Keeps the best, and for each reading of each slot the best that has it, so that each rival is heard.
  void keep_contenders(const std::vector<Scored>& all) {
    std::set<std::pair<std::size_t, int>> heard;
    for (const Scored& scored : all) {
      bool is_new = scored_.size() < kTried;
      for (const std::size_t slot : {kPositionSlot, kVelocitySlot, kAttitudeSlot})
        is_new = heard.insert({slot, scored.choice[slot]}).second || is_new;
      if (is_new) scored_.push_back(scored);
    }
  }

  /// Adds the readings that differ from the best only in the specific force or the rates.
  void add_variants() {
    const Scored winner = best();
    for (const std::size_t slot : {kForceSlot, kRateSlot}) {
      if (winner.choice[slot] == kNone) continue;
      const auto bits_of = [&](const Reading& r) { return r.bits + evidence(slot, winner.choice, r); };
      const double own = bits_of(reading(slot, winner.choice[slot]));
      for (int i = kNone; i < count(slot); ++i) {
        Scored variant = winner;
        variant.choice[slot] = i;
        variant.bits += (i == kNone ? 0 : bits_of(reading(slot, i))) - own;
        if (i != winner.choice[slot]) scored_.push_back(variant);
      }
    }
  }

  const RawLog& log_;
  const Knots& knots_;
  std::array<std::vector<Reading>, kNumSlots> readings_;
  std::array<std::vector<ThreeSeries>, 2> accelerations_;
  std::array<std::vector<std::vector<double>>, 2> thrust_axis_;  ///< by motion and attitude
  std::vector<Scored> scored_;                                   ///< best first
};

/// The quantities and signals that a slot can hold.
struct SlotKind {
  std::vector<Quantity> quantities;
  std::vector<int> signals;
};
const std::array<SlotKind, kNumSlots>& slot_kinds() {
  static const std::array<SlotKind, kNumSlots> kinds = {
      {{{kIsPosition}, {kPosition}},
       {{kIsVelocity}, {kVelocity}},
       {{kIsQuaternion, kIsAngles}, {kAttitude, kPackedAttitude, kEuler}},
       {{kIsSpecificForce}, {kForceBody, kForceWorld}},
       {{kIsRates}, {kRates}}}};
  return kinds;
}

class Assigner {
 public:
  Assigner(const RawLog& log, Recognition& found) : log_(log), found_(found), knots_(knots_of(log)) {
    for (const RawTopic& topic : log.topics) taken_.emplace_back(topic.columns.size(), 0);
    for (const Carried& carried : found.groups) take(carried);
    take_clocks();
    groups_ = column_groups(log, taken_);
    refuse_mixed_units();
  }

  void assign() {
    if (groups_.empty() && found_.groups.empty()) return;
    if (knots_.time_s.empty())
      assign_names();
    else
      assign_motion();
    assign_motors();
    assign_battery();
    assign_targets(kIsTargetPosition, kTargetPosition, kPosition);
    assign_targets(kIsTargetVelocity, kTargetVelocity, kVelocity);
    report_unused();
  }

 private:
  void take(const Carried& carried) {
    for (const int c : carried.columns)
      if (c >= 0) taken_[carried.topic][static_cast<std::size_t>(c)] = 1;
  }

  /// Columns that count with the records are clocks, whatever they are called; a position may move evenly.
  void take_clocks() {
    for (std::size_t t = 0; t < log_.topics.size(); ++t) {
      const RawTopic& topic = log_.topics[t];
      for (std::size_t c = 0; c < topic.columns.size() && topic.time_s.size() > 8; ++c) {
        const NameReading name = read_name(topic.columns[c].name);
        const bool is_named = *std::max_element(name.bits.begin(), name.bits.end()) > kLikelyName;
        if (is_named && is_plain_table(log_, topic) && !holds_numbers(topic.columns[c].values))
          found_.rejected.push_back(topic.columns[c].name + ": it holds no number");
        if (name.kind != IndexKind::kNone && name.kind != IndexKind::kNumber) continue;
        if (correlation_of(topic.time_s, topic.columns[c].values) > 0.9999) taken_[t][c] = 1;
      }
    }
  }

  /// A group has one factor.
  void refuse_mixed_units() {
    const auto is_mixed = [&](const ColumnGroup& group) {
      if (group.unit != kMixedUnits) return false;
      if (group.kind != IndexKind::kNone) report(group, "different units");
      return true;
    };
    groups_.erase(std::remove_if(groups_.begin(), groups_.end(), is_mixed), groups_.end());
  }

  static Carried carried_of(const ColumnGroup& group) {
    Carried carried;
    carried.topic = group.topic;
    carried.columns = group.columns;
    return carried;
  }

  void report(const ColumnGroup& group, const char* why) const {
    found_.rejected.push_back(names_of(log_, carried_of(group)) + ": " + why);
  }

  bool is_free(const ColumnGroup& group) const {
    return std::all_of(group.columns.begin(), group.columns.end(),
                       [&](int c) { return c < 0 || taken_[group.topic][static_cast<std::size_t>(c)] == 0; });
  }

  void add(Carried carried) {
    take(carried);
    found_.groups.push_back(std::move(carried));
  }

  const Carried* known(const std::vector<int>& signals) const {
    for (const int signal : signals)
      if (const Carried* const carried = found_.find(signal)) return carried;
    return nullptr;
  }

  /// Only a header is known: the likeliest names, in SI units or those that they state.
  void assign_names() {
    for (const Quantity quantity :
         {kIsPosition, kIsVelocity, kIsQuaternion, kIsAngles, kIsSpecificForce, kIsRates}) {
      const int signal = kSignalOfQuantity[quantity];
      if (known({signal}) != nullptr) continue;
      const std::size_t width = signal == kAttitude ? 4 : 3;
      const ColumnGroup* const group = likeliest(quantity, width);
      if (group == nullptr) continue;
      const std::optional<UnitFactor> factor = unit_factor(signal, group->unit);
      add({signal, group->topic, group->columns, factor ? group->unit : "", factor.value_or(UnitFactor())});
    }
  }

  const ColumnGroup* likeliest(Quantity quantity, std::size_t least_width) const {
    const ColumnGroup* best = nullptr;
    double most = kLikelyName;
    for (const ColumnGroup& group : groups_) {
      if (group.kind == IndexKind::kNone || group.columns.size() < least_width || !is_free(group)) continue;
      const bool is_whole = std::count(group.columns.begin(), group.columns.end(), kNone) == 0;
      if (group.bits[quantity] <= most || (quantity == kIsMotors && !is_whole)) continue;
      most = group.bits[quantity];
      best = &group;
    }
    return best;
  }

  std::vector<Reading> readings(const SlotKind& kind) const {
    if (const Carried* const carried = known(kind.signals)) return readings_of_known(log_, knots_, *carried);
    std::vector<Reading> all;
    for (const Quantity quantity : kind.quantities)
      for (const ColumnGroup& group : groups_) {
        if (group.is_foreign || group.is_wish || group.bits[quantity] < -15) continue;
        for (Reading& reading : readings_of(log_, knots_, group, quantity)) all.push_back(std::move(reading));
      }
    return all;
  }

  void assign_motion() {
    std::array<std::vector<Reading>, kNumSlots> all;
    for (std::size_t slot = 0; slot < kNumSlots; ++slot) all[slot] = readings(slot_kinds()[slot]);
    const MotionSearch search(log_, knots_, std::move(all));
    for (std::size_t slot = 0; slot < kNumSlots; ++slot) {
      const int index = search.best().choice[slot];
      if (index == kNone) continue;
      const Reading& winner = search.reading(slot, index);
      if (const Carried* const named = known(slot_kinds()[slot].signals)) {
        correct(winner, std::min(search.lead_over(slot, *named), search.confirmation()));
        continue;
      }
      const MotionSearch::Odds odds = search.odds_of(slot);
      if (odds.bits < kClear_bits) {
        doubt(winner, odds);
        continue;
      }
      Carried carried = winner.carried;
      carried.odds_bits = odds.bits;
      carried.runner_up = odds.runner_up;
      add(std::move(carried));
    }
  }

  /// The unit, order and signs of a known name give way to what the motion shows beyond doubt.
  void correct(const Reading& shown, double lead_bits) {
    constexpr double kBeyondDoubt = 2 * kClear_bits;
    for (Carried& carried : found_.groups) {
      if (carried.signal != shown.carried.signal || lead_bits < kBeyondDoubt) continue;
      found_.decided.push_back(
          fmt::format("{}: {}, as the motion shows, and not what the name says ({:.0f} bits)",
                      names_of(log_, carried), shown.words, lead_bits));
      carried = shown.carried;
      carried.odds_bits = lead_bits;
      carried.runner_up = "what the name says";
    }
  }

  void doubt(const Reading& winner, const MotionSearch::Odds& odds) {
    found_.rejected.push_back(
        fmt::format("{}: {} or {}, odds of only {:.1f} bits; say which in a columns.toml (--columns)",
                    names_of(log_, winner.carried), winner.words, odds.runner_up, odds.bits));
    take(winner.carried);
  }

  const std::vector<double>& values(const ColumnGroup& group, std::size_t k) const {
    return log_.topics[group.topic].columns[static_cast<std::size_t>(group.columns[k])].values;
  }

  /// Outputs of an array that never leave their least value drive no motor.
  ColumnGroup without_idle(const ColumnGroup& group) const {
    const double least = range_of(group).first;
    ColumnGroup driven = group;
    driven.columns.clear();
    for (std::size_t k = 0; k < group.columns.size(); ++k)
      if (quantile_of(values(group, k), 1) > least) driven.columns.push_back(group.columns[k]);
    return driven.columns.size() >= 4 ? driven : group;
  }

  /// Returns the least and the largest value.
  std::pair<double, double> range_of(const ColumnGroup& group) const {
    std::pair<double, double> range = {INFINITY, -INFINITY};
    for (std::size_t k = 0; k < group.columns.size(); ++k) {
      range.first = std::min(range.first, quantile_of(values(group, k), 0));
      range.second = std::max(range.second, quantile_of(values(group, k), 1));
    }
    return range;
  }

  void assign_motors() {
    if (known(kRotorSignals) != nullptr) return;
    const ColumnGroup* const group = likeliest(kIsMotors, 4);
    if (group == nullptr) return;
    const auto [low, high] = range_of(*group);
    if (!std::isnan(low) && !(low >= 0 && high < 65536)) return;
    const ColumnGroup driven = without_idle(*group);
    if (driven.columns.size() < 4) return;
    const bool is_pulse = high > 800 && high < 2500;
    const std::string unit = is_pulse       ? "us"
                             : high <= 1.5  ? "1"
                             : high <= 100  ? "%"
                             : high <= 255  ? "1/255"
                             : high <= 1000 ? "permille"
                                            : "PWM";
    const int signal = driven.columns.size() == 4 && !is_pulse ? kDuty : kMotorCommand;
    const Carried carried{signal, driven.topic, driven.columns, unit, *unit_factor(signal, unit)};
    found_.decided.push_back(
        fmt::format("{}: read as commands of motors in {}, by their range", names_of(log_, carried), unit));
    add(carried);
  }

  void assign_battery() {
    if (known({kBattery}) != nullptr) return;
    for (const ColumnGroup& group : groups_) {
      if (group.columns.size() != 1 || group.bits[kIsBattery] < kLikelyName || !is_free(group)) continue;
      const double middle = median(values(group, 0));
      const bool is_millivolt = middle > 500;
      if (middle < 2 || middle > 70000) continue;
      add({kBattery,
           group.topic,
           group.columns,
           is_millivolt ? "mV" : "V",
           {1, is_millivolt ? 1000.0 : 1.0}});
      return;
    }
  }

  /// The set point that the vehicle follows most closely, in the unit and frame in which it does.
  void assign_targets(Quantity quantity, int signal, int followed) {
    if (known({signal}) != nullptr) return;
    const ColumnGroup* const group = likeliest(quantity, 3);
    if (group == nullptr || std::count(group->columns.begin(), group->columns.end(), -1) == 3) return;
    if (knots_.time_s.empty()) {
      add({signal, group->topic, group->columns, ""});
      return;
    }
    const Carried* const vehicle = found_.find(followed);
    std::vector<Reading> all = readings_of(log_, knots_, *group, quantity);
    if (vehicle != nullptr) {
      const std::vector<Reading> own = readings_of_known(log_, knots_, *vehicle);
      if (own.empty()) return;
      for (Reading& reading : all) {
        reading.is_down = reading.carried.sign[2] < 0;
        reading.bits += following_bits(knots_, own[0], reading) +
                        (reading.carried.sign == vehicle->sign ? 8 : 0) +
                        (reading.carried.factor.divide == vehicle->factor.divide ? 8 : 0);
      }
    }
    if (all.empty()) return;
    add(std::max_element(all.begin(), all.end(), [](const Reading& a, const Reading& b) {
          return a.bits < b.bits;
        })->carried);
  }

  /// Says why columns with the names of a motion are not used, where no others are.
  void report_unused() const {
    for (const ColumnGroup& group : groups_) {
      if (group.kind == IndexKind::kNone || group.columns.size() < 3 || !is_free(group) ||
          knots_.time_s.empty())
        continue;
      if (group.kind == IndexKind::kNumber && group.bits[kIsMotors] > 0 && known(kRotorSignals) == nullptr)
        report(group, "perhaps commands of motors; say so in a columns.toml (--columns)");
      const auto named = std::max_element(group.bits.begin(), group.bits.begin() + kIsMotors);
      const auto slot = std::find_if(slot_kinds().begin(), slot_kinds().end(), [&](const SlotKind& kind) {
        return std::count(kind.quantities.begin(), kind.quantities.end(), named - group.bits.begin()) > 0;
      });
      if (group.is_foreign)
        report(group, "not the vehicle's motion, as its name says");
      else if (*named > kLikelyName && known(slot->signals) == nullptr)
        report(group, is_dead(log_.topics[group.topic], carried_of(group))
                          ? "only zeros"
                          : "the rest of the log contradicts its name");
    }
  }

  const std::vector<int> kRotorSignals = {kDuty, kRequested, kMotorCommand, kRotorSpeed, kMotorForce};
  const RawLog& log_;
  Recognition& found_;
  const Knots knots_;
  std::vector<std::vector<char>> taken_;
  std::vector<ColumnGroup> groups_;
};

}  // namespace

void assign_by_evidence(const RawLog& log, Recognition& found) { Assigner(log, found).assign(); }

}  // namespace swarmcert::logs
