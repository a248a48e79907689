/// @file The files of a release, each read once, and the library results derived from them.
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
struct FlownLoop;
}

namespace swarmcert::gate {

/// A precondition of a check does not hold: the check fails with this reason.
struct Unfounded : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A proved Lipschitz bound of one function with respect to one input block, in Euclidean norms.
struct LipschitzBound {
  files::FunctionId function;
  std::string block, domain;
  double upper = 0;
  std::optional<double> lower;  ///< an attained slope
  std::string unit;
};

struct GateSettings {
  int jobs = 0;
  std::string baseline;  ///< file; empty: none
  bool may_lack_baseline = false;
  std::function<void(int done, int total, const std::string& what)> progress;
  bool updates_baseline = false;  ///< limits may be looser than in the baseline; they are reported
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

  /// Returns the network used in flight: rounded to float32 unless the policy says float64.
  /// @throws files::InputError
  const files::Network& flown();
  const files::Json& certificate();
  const check::CheckResult& certificate_verdict();

  /// Returns the proved bounds of the network used in flight. They come from the certificate if the checker accepts
  /// it for the precision used in flight. Without a certificate, or if the policy has a check of its own that rejects
  /// the certificate, the bounds are computed and proved here.
  /// @throws Unfounded if the certificate is rejected and no other check of the policy reports it.
  const std::vector<LipschitzBound>& bounds();
  /// Returns bounds over all inputs and all coordinates, by function; computed if the certificate lacks one.
  std::map<files::FunctionId, double> global_bounds();

  /// Returns why the certificate proves nothing about the network used in flight; empty if it does.
  std::string why_not_certified();

  /// Returns box.toml of the release, otherwise the set that the clamp lets through.
  /// @throws Unfounded if there is neither.
  lipschitz::Domain domain();

  const stability::FlownLoop& tracking();

  /// Compares the model with the reference flights; with the closed loop if the policy asks for a guard factor.
  const residuals::Comparison& comparison();
  /// Like comparison(), but without the closed loop if it cannot be simulated.
  const residuals::Comparison& residual_comparison();

  /// Error of the velocity estimate used by the control law in the reference flights; null if no log measures it.
  const residuals::VelocityError* velocity_error();

  /// Largest tracking errors of the reference flights, which comparison() must have found valid.
  std::vector<residuals::FlightPeak> flight_peaks();

  /// Values and limits of the last release; null if there is no baseline and none is required.
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
  std::unique_ptr<stability::FlownLoop> tracking_;
  std::unique_ptr<residuals::Comparison> comparison_, residual_comparison_;
  std::unique_ptr<residuals::VelocityError> velocity_error_;
  bool looked_for_velocity_error_ = false;
  std::unique_ptr<Baseline> baseline_;
};

/// A file on which a release depends, with its role.
struct EvidenceFile {
  std::string role;  ///< "policy", "network", "weights", "certificate", "gains", "model", "log", ...
  std::string path;
};

/// Returns every file of the release, including files named inside its files (weights, models of vehicles, networks
/// of models), without duplicates, in order. Unreadable files are listed, but not the files that they would name.
std::vector<EvidenceFile> evidence_files(const Policy& policy, const std::string& baseline);

}  // namespace swarmcert::gate
