#include "analysis/identification/verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>

namespace swarmcert::identification {
namespace {

constexpr const char* kNames[] = {"missing_effect", "unexplained", "nothing_missing", "inconclusive"};

/// Returns why one kind cannot be judged; empty if it can.
std::string not_judged(const Diagnosis& diagnosis) {
  if (!diagnosis.too_poor.empty()) return diagnosis.too_poor;
  if (diagnosis.remainder.ratio > 0) return "";
  return "the remainder has no spectrum: no stretch of 256 records without a cut";
}

}  // namespace

const char* name(Verdict verdict) { return kNames[static_cast<int>(verdict)]; }

void describe(files::Record& record, Verdict verdict) {
  record.choice(verdict, {std::begin(kNames), std::end(kNames)});
}

bool leaves_something(const Diagnosis& diagnosis) {
  // No model includes the torques of flapping blades or of wind on the hull.
  constexpr double kMostOfTorque = 0.5;
  const auto explains = [](const Scan& scan, double share) {
    return !scan.entries.empty() && scan.entries[0].share >= share;
  };
  return diagnosis.remainder.stands_out() || explains(diagnosis.scan, kMuchOfForce) ||
         explains(diagnosis.balance, kMostOfTorque);
}

Verdict verdict_of(const std::vector<Diagnosis>& diagnoses, std::string& reason) {
  reason.clear();
  const auto any = [&diagnoses](auto holds) {
    return std::any_of(diagnoses.begin(), diagnoses.end(), holds);
  };
  if (any([](const Diagnosis& d) { return !d.ranking.empty(); })) return Verdict::kMissingEffect;
  if (any(leaves_something)) return Verdict::kUnexplained;
  for (const Diagnosis& diagnosis : diagnoses) {
    const std::string why = not_judged(diagnosis);
    if (why.empty()) continue;
    reason += fmt::format("{}vehicles of kind {}: {}", reason.empty() ? "" : "; ", diagnosis.kind, why);
  }
  return reason.empty() && !diagnoses.empty() ? Verdict::kNothingMissing : Verdict::kInconclusive;
}

}  // namespace swarmcert::identification
