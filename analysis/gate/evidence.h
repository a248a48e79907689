/// @file The files of a release, each read once, and what the libraries say about them.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "analysis/gate/policy.h"
#include "lipschitz/base/box.h"
#include "nn/base/json.h"

namespace swarmcert::check {
struct CheckResult;
}
namespace swarmcert::residuals {
struct Comparison;
struct FlightPeak;
struct Inputs;
struct VelocityError;
}  // namespace swarmcert::residuals
namespace swarmcert::stability {
struct TrackingSetup;
}

namespace swarmcert::gate {

/// What a check rests on does not hold: the check fails with this reason.
struct Unfounded : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A proved Lipschitz bound of one function for one block of inputs, Euclidean norms.
struct LipschitzBound {
  files::FunctionId function;
  std::string block, domain;
  double upper = 0;
  std::optional<double> lower;  ///< a slope that is attained
  std::string unit;
};

struct GateSettings {
  int jobs = 0;
  std::string baseline;  ///< file; empty: none
  bool may_lack_baseline = false;
  std::function<void(int done, int total, const std::string& what)> progress;
  bool updates_baseline = false;  ///< limits may be looser than the baseline's, and are named
};

struct Baseline;

class Evidence {
 public:
  Evidence(const Policy& policy, const GateSettings& settings);
  ~Evidence();
  Evidence(const Evidence&) = delete;
  Evidence& operator=(const Evidence&) = delete;

  const Policy& policy() const { return policy_; }
  const Release& release() const { return policy_.release; }
  const GateSettings& settings() const { return settings_; }

  /// As it flies: rounded to float32 unless the policy says float64. @throws files::InputError
  const files::Network& flown();
  const files::Json& certificate();
  const check::CheckResult& certificate_verdict();

  /// What is proved of the flown network: by the certificate, if the checker accepts it for the flown precision.
  /// Without a certificate, and where the policy judges a rejected one by itself, the bounds are computed and proved
  /// here.
  /// @throws Unfounded if the certificate is rejected and nothing else in the policy says so.
  const std::vector<LipschitzBound>& bounds();
  /// Bounds for all inputs and all their coordinates, by function; computed where the certificate lacks one.
  std::map<files::FunctionId, double> global_bounds();

  /// Why the certificate does not prove anything about what flies; empty if it does.
  std::string why_not_certified();

  /// box.toml of the release, else what the clamp lets through. @throws Unfounded if there is neither.
  lipschitz::Domain domain();

  const stability::TrackingSetup& tracking();

  /// The model against the reference flights; with the closed loop where the policy asks for a guard factor.
  const residuals::Comparison& comparison();
  /// As comparison(), but without the closed loop where that cannot be flown.
  const residuals::Comparison& residual_comparison();

  /// Error of the velocity that the reference flights' law was given; null where no log measures it.
  const residuals::VelocityError* velocity_error();

  /// Largest tracking errors of the reference flights, which comparison() has found sound.
  std::vector<residuals::FlightPeak> flight_peaks();

  /// Values and limits of the last release; nothing where there is no baseline and none is needed.
  const Baseline* baseline();

 private:
  residuals::Inputs read_flights() const;
  void load_comparison(bool with_loop);
  void compute_bounds();

  const Policy& policy_;
  GateSettings settings_;
  std::unique_ptr<files::Network> network_;
  std::unique_ptr<files::Json> certificate_;
  std::unique_ptr<check::CheckResult> verdict_;
  std::unique_ptr<std::vector<LipschitzBound>> bounds_, computed_;
  std::unique_ptr<stability::TrackingSetup> tracking_;
  std::unique_ptr<residuals::Comparison> comparison_, residual_comparison_;
  std::unique_ptr<residuals::VelocityError> velocity_error_;
  bool looked_for_velocity_error_ = false;
  std::unique_ptr<Baseline> baseline_;
};

/// A file that a release rests on, and as what.
struct EvidenceFile {
  std::string role;  ///< "policy", "network", "weights", "certificate", "gains", "model", "log", ...
  std::string path;
};

/// Every file of the release, those named inside its files too (weights, models of vehicles, networks of models), once
/// each, in order. Files that cannot be read are listed, what they would name is not.
std::vector<EvidenceFile> evidence_files(const Policy& policy, const std::string& baseline);

}  // namespace swarmcert::gate
