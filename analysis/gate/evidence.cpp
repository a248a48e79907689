#include "analysis/gate/evidence.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/gate/baseline.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/flight_errors.h"
#include "analysis/residuals/flight_peaks.h"
#include "analysis/residuals/inputs.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/values/range.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"
#include "stability/bounds/flown_loop.h"

namespace swarmcert::gate {
namespace {

bool is_stored_as_float32(const files::Network& network) {
  for (const auto& [name, weights] : files::parts(network))
    if (weights->precision != files::Precision::kFloat32) return false;
  return true;
}

}  // namespace

Evidence::Evidence(const Policy& policy, const GateSettings& settings)
    : policy_(policy), settings_(settings) {}
Evidence::~Evidence() = default;

const files::Network& Evidence::flown() {
  if (!network_) {
    files::Network network = files::load_network(release().network);
    for (const auto& [part, weights] : files::parts(network))
      if (!weights->assumed.empty())
        throw Unfounded(weights->path +
                        " is read by a guess, which network.toml must state: " + weights->assumed.front());
    if (release().is_float32 && !is_stored_as_float32(network))
      network = files::as_float32(std::move(network));
    network_ = std::make_unique<files::Network>(std::move(network));
  }
  return *network_;
}

const files::Json& Evidence::certificate() {
  if (!certificate_) {
    certificate_ = std::make_unique<files::Json>(
        check::parse_certificate(files::read_file(release().certificate), release().certificate));
  }
  return *certificate_;
}

const check::CheckResult& Evidence::certificate_verdict() {
  if (!verdict_) {
    const files::Network stored =
        files::load_network(check::with_stated_options(certificate(), release().network));
    verdict_ = std::make_unique<check::CheckResult>(check::check(certificate(), stored));
  }
  return *verdict_;
}

std::string Evidence::why_not_certified() {
  const check::CheckResult& verdict = certificate_verdict();
  if (!verdict.accepted) return verdict.reason;
  const files::Json& as = certificate()["network"]["as"];
  const bool is_stored_float32 = is_stored_as_float32(files::load_network(release().network));
  if (release().is_float32 && !is_stored_float32 && as != "float32")
    return "it refers to the float64 weights as stored, but float32 is used in flight: certify --as float32";
  if (!release().is_float32 && as == "float32")
    return "it refers to weights rounded to float32, but the policy states that float64 is used in flight";
  return "";
}

void Evidence::compute_bounds() {
  if (computed_) return;
  const files::Network& network = flown();
  lipschitz::CertifyOptions options;
  options.blocks = policy_.blocks;
  options.jobs = settings_.jobs;
  options.progress = settings_.progress;
  const lipschitz::Certification found = certify(network, options);
  computed_ = std::make_unique<std::vector<LipschitzBound>>();
  for (const lipschitz::CertifiedBound& bound : found.bounds) {
    LipschitzBound one{bound.function,      bound.block,  bound.domain,
                       bound.upper.value(), std::nullopt, files::unit(network, bound.function, bound.block)};
    if (bound.lower.witness) one.lower = bound.lower.witness->slope.value();
    computed_->push_back(std::move(one));
  }
}

const std::vector<LipschitzBound>& Evidence::bounds() {
  if (bounds_) return *bounds_;
  const std::string rejected = release().certificate.empty() ? "" : why_not_certified();
  if (release().certificate.empty() || (!rejected.empty() && policy_.judges_certificate)) {
    compute_bounds();
    return *computed_;
  }
  if (!rejected.empty()) throw Unfounded("the certificate is rejected: " + rejected);
  auto bounds = std::make_unique<std::vector<LipschitzBound>>();
  for (const files::Json& bound : certificate()["bounds"]) {
    if (!bound["scale"].empty() || bound.contains("neighbours"))
      continue;  // bounds for a group do not cover fewer neighbours
    const files::FunctionId function = bound["function"].get<std::string>();
    const auto block = bound["block"].get<std::string>();
    LipschitzBound one{function,
                       block,
                       bound["domain"].get<std::string>(),
                       bound["upper"].get<double>(),
                       std::nullopt,
                       files::unit(flown(), function, block)};
    if (bound["lower"].is_number()) one.lower = bound["lower"].get<double>();
    bounds->push_back(std::move(one));
  }
  bounds_ = std::move(bounds);
  return *bounds_;
}

std::map<files::FunctionId, double> Evidence::global_bounds() {
  const auto all_of = [](const std::vector<LipschitzBound>& bounds) {
    std::map<files::FunctionId, double> result;
    for (const LipschitzBound& bound : bounds)
      if (bound.block == "all" && bound.domain == "global") result[bound.function] = bound.upper;
    return result;
  };
  std::map<files::FunctionId, double> result = all_of(bounds());
  for (const files::FunctionId& function : files::functions(flown())) {
    if (result.count(function) == 1) continue;
    compute_bounds();
    return all_of(*computed_);
  }
  return result;
}

lipschitz::Domain Evidence::domain() {
  if (!release().box.empty()) return lipschitz::read_domain(release().box, flown());
  lipschitz::Domain clamp = lipschitz::clamp_domain(flown());
  if (clamp.empty()) throw Unfounded("no box: name box in [release], or clamp the inputs in network.toml");
  return clamp;
}

const stability::FlownLoop& Evidence::tracking() {
  if (!tracking_) {
    tracking_ = std::make_unique<stability::FlownLoop>(
        stability::load_flown_loop(release().gains, release().model, release().battery_V));
    const std::string problem = stability::battery_problem(tracking_->model, release().battery_V);
    if (!problem.empty()) {
      tracking_.reset();
      throw files::InputError({policy_.path, "", "release.battery_V", "", problem, "correct battery_V"});
    }
  }
  return *tracking_;
}

residuals::Inputs Evidence::read_flights() const {
  residuals::InputArguments arguments;
  arguments.models = {release().model};
  arguments.flights = release().flights;
  arguments.fleet = release().vehicles;
  arguments.columns = release().columns;
  if (release().feed_forward) arguments.network = release().network.file;
  return residuals::read_inputs(arguments);
}

const residuals::VelocityError* Evidence::velocity_error() {
  if (!looked_for_velocity_error_) {
    residual_comparison();
    const auto found = residuals::velocity_error(residuals::flight_errors(read_flights(), settings_.jobs));
    if (found) velocity_error_ = std::make_unique<residuals::VelocityError>(*found);
    looked_for_velocity_error_ = true;
  }
  return velocity_error_.get();
}

std::vector<residuals::FlightPeak> Evidence::flight_peaks() {
  residual_comparison();
  return residuals::flight_peaks(read_flights(), settings_.jobs);
}

void Evidence::load_comparison(bool with_loop) {
  const residuals::Inputs inputs = read_flights();
  std::size_t logs = 0;
  for (const residuals::FlightFiles& flight : inputs.found.flights) logs += flight.logs.size();
  if (logs != static_cast<std::size_t>(release().logs)) {
    throw files::InputError({release().flights.front(), "", "flights", std::to_string(logs) + " logs",
                             "are not the " + std::to_string(release().logs) + " that the policy states",
                             "restore them"});
  }
  residuals::GainsOfKinds gains;
  if (with_loop) gains.emplace("", stability::load_gains(release().gains));
  const auto progress = [this](int done, int total) {
    if (settings_.progress) settings_.progress(done, total, "flights");
  };
  auto found =
      std::make_unique<residuals::Comparison>(residuals::compare(inputs, settings_.jobs, progress, gains));
  std::string damaged;
  for (const std::string& problem : found->problems) damaged += (damaged.empty() ? "" : "; ") + problem;
  for (const residuals::TrackErrors& track : found->tracks) {
    if (track.is_sound) continue;
    damaged +=
        (damaged.empty() ? "" : "; ") + track.path + fmt::format(": {}", fmt::join(track.findings, ", "));
  }
  if (!damaged.empty()) {
    throw files::InputError({release().flights.front(), "", "flights", "",
                             "a reference flight is damaged: " + damaged, "restore the log"});
  }
  (with_loop ? comparison_ : residual_comparison_) = std::move(found);
}

const residuals::Comparison& Evidence::comparison() {
  if (!comparison_) load_comparison(true);
  return *comparison_;
}

const residuals::Comparison& Evidence::residual_comparison() {
  if (!comparison_ && !residual_comparison_ && policy_.wants_guard_factor) {
    try {
      load_comparison(true);
    } catch (const files::InputError&) {
      load_comparison(false);  // the guard factor's check reports what is wrong with the loop
    }
  }
  if (comparison_) return *comparison_;
  if (!residual_comparison_) load_comparison(false);
  return *residual_comparison_;
}

const Baseline* Evidence::baseline() {
  const std::string& path = settings_.baseline;
  const bool is_there = !path.empty() && !(settings_.may_lack_baseline && !std::filesystem::exists(path));
  if (!baseline_ && is_there) baseline_ = std::make_unique<Baseline>(read_baseline(path));
  return baseline_.get();
}

}  // namespace swarmcert::gate
