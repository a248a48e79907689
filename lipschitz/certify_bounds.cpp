#include "lipschitz/certify_bounds.h"

#include <algorithm>

#include "lipschitz/base/rounding.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/bent_bound.h"
#include "lipschitz/upper/eclipse_fast.h"
#include "lipschitz/values/range.h"
#include "nn/base/parallel.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::Network;

/// Share of the total time for the bounds over all inputs if branch and bound follows; and share of the time of one
/// branch-and-bound task for the search itself, after which the proof is checked and lower bounds are searched again.
constexpr double kShareBeforeBranch = 0.3, kShareOfBoxes = 0.6;

std::string called(const CertifiedBound& bound) {
  return bound.function.name() + " " + bound.block +
         (bound.neighbours.empty() ? "" : " with a limited number of neighbours");
}

bool has_program(UpperMethod method, const CertifiedBound& bound) {
  return method != UpperMethod::kProduct && bound.neighbours.empty();
}

bool searches_boxes(const CertifyOptions& options) {
  return options.method == UpperMethod::kBranch ||
         (options.method == UpperMethod::kAuto && !options.domain.empty());
}

/// Whether branch and bound runs: over a box for all activations that act entry by entry, else for ReLU only.
bool is_branched(const CertifyOptions& options, const CertifiedBound& bound) {
  if (!searches_boxes(options) || bound.function.is_rho()) return false;
  return bound.is_relu || (bound.domain == "box" && bound.has_slopes && bound.neighbours.empty());
}

/// Returns the smaller of `own` (0: none) and the time until `stop`, in seconds; 0: no limit.
double seconds_until(const Stop& stop, double own) {
  if (!stop.has_limit()) return own;
  const double left = std::max(stop.seconds_left(), Stop::kLeast_s);
  return own > 0 ? std::min(own, left) : left;
}

void bound_layer_by_layer(const Network& network, CertifiedBound& bound) {
  const std::vector<check::Matrix> stages = check::stages(network, bound.function, bound.block, bound.scale);
  if (stages.size() == 1) return;  // sdp_bound() proves the spectral norm just as fast
  std::optional<UpperProof> proof = eclipse_fast(stages);
  if (!proof || !(proof->upper.value() < bound.upper.value())) return;
  bound.upper = proof->upper;
  bound.method = UpperMethod::kEclipseFast;
  bound.proof = std::move(proof);
}

void solve_program(const Network& network, const CertifyOptions& options, const Stop& stop,
                   CertifiedBound& bound) {
  const check::BentChain chain = check::bent_chain(network, bound.function, bound.block, bound.scale);
  bound.sdp =
      chain.is_bent() ? bent_bound(chain, {stop, bound.upper}) : sdp_bound(chain.stages, {stop, bound.upper});
  if (!bound.sdp.proof) return;
  const bool is_wanted =
      options.method == UpperMethod::kSdp && !is_interrupted(bound.sdp.stop) && !chain.is_bent();
  if (!is_wanted && !(bound.sdp.proof->upper.value() < bound.upper.value())) return;
  bound.upper = bound.sdp.proof->upper;
  bound.method = UpperMethod::kSdp;
  bound.proof = std::move(bound.sdp.proof);
  bound.sdp.proof.reset();
}

/// Returns the box of the inputs of the bound, after the clamp.
Box box_of(const Network& network, const CertifyOptions& options, const CertifiedBound& bound) {
  return clamped(network, options.domain).at(bound.function.input_part());
}

/// Improves the bound by the product with the steepest activation slopes on the box.
void multiply_local_slopes(const Network& network, const check::Intervals& box,
                           const std::vector<CertifiedLayer>& layers, CertifiedBound& bound) {
  const std::vector<files::FunctionId> names = bound.function.parts();
  const auto parts = files::parts(network);
  check::Dyadic total = bound.scale.empty() ? 1.0 : *std::max_element(bound.scale.begin(), bound.scale.end());
  for (const CertifiedLayer& layer : layers)
    if (std::find(names.begin(), names.end(), layer.network) != names.end())
      total = total * check::Dyadic(layer.norm.norm.upper.value());
  total = total * check::steepest_on_box(*parts.at(names.front()), box);
  if (names.size() == 2)
    for (const double steepest : parts.at(names.back())->steepest_slopes())
      total = total * check::Dyadic(steepest);
  const double upper = rounded_up(total);
  if (!(upper < bound.upper.value())) return;
  bound.upper = UpperBound(upper);
  bound.method = UpperMethod::kLocalProduct;
  bound.proof.reset();
}

void search_below(const Network& network, const CertifyOptions& options, const Stop& stop,
                  std::vector<Eigen::VectorXd> starts, CertifiedBound& bound) {
  LowerBoundOptions lower = options.lower;
  lower.cancelled = options.cancelled;
  lower.seconds = seconds_until(stop, options.lower.seconds);
  lower.starts = std::move(starts);
  FoundSlope found = lower_bound(network, bound, options.domain, lower);
  const int rounds = bound.lower.rounds + found.rounds;
  const bool interrupted = bound.lower.interrupted || found.interrupted;
  const bool is_steeper = found.witness && (!bound.lower.witness || found.witness->slope.value() >
                                                                        bound.lower.witness->slope.value());
  if (is_steeper) bound.lower = std::move(found);
  bound.lower.rounds = rounds;
  bound.lower.interrupted = interrupted;
}

/// Initialises the bound for a given number of neighbours with the one proved for any number.
void start_from_any_number(const std::vector<CertifiedBound>& bounds, CertifiedBound& counted) {
  const auto any = std::find_if(bounds.begin(), bounds.end(), [&](const CertifiedBound& bound) {
    return bound.function == counted.function && bound.block == counted.block && bound.neighbours.empty() &&
           bound.scale.empty();
  });
  counted.upper = any->upper;
  counted.method = any->method;
  counted.proof = any->proof;
  counted.local = any->local;
  counted.sdp = any->sdp;
}

/// Replaces the bound for all inputs by a smaller one for the box, if branch and bound finds one.
/// @param jobs number of threads for its boxes.
void branch_further(const Network& network, const Domain& domain, const CertifyOptions& options,
                    const Stop& stop, int jobs, CertifiedBound& bound) {
  BranchOptions branch = options.branch;
  branch.jobs = jobs;
  branch.known = bound.lower.witness ? bound.lower.witness->slope.value() : 0;
  branch.cancelled = options.cancelled;
  branch.seconds = seconds_until(stop.after_share(kShareOfBoxes), options.branch.seconds);
  if (options.progress) {
    branch.progress = [&options, &bound](double share, double upper) {
      constexpr int kPermille = 1000;
      options.progress(static_cast<int>(share * kPermille), kPermille,
                       "branch and bound of " + called(bound) + ", at most " + std::to_string(upper));
    };
  }
  const UpperProof* const global = bound.proof       ? &*bound.proof
                                   : bound.sdp.proof ? &*bound.sdp.proof
                                                     : nullptr;
  LocalBound local =
      local_bound(network, bound, domain, global != nullptr ? global->t : std::vector<double>(), branch);
  bound.nodes = local.nodes;
  bound.outlook = local.outlook;
  bound.branch_stop = local.stop;
  search_below(network, options, stop, std::move(local.steep_centres), bound);
  if (!local.proof || !(local.upper.value() < bound.upper.value())) return;
  bound.upper = local.upper;
  bound.method = UpperMethod::kBranch;
  bound.local = std::move(local.proof);
  if (bound.proof) bound.sdp.proof = std::move(bound.proof);  // other searches may start from its multipliers
  bound.proof.reset();
}

/// Runs branch and bound for all `bounds` that request it, those for any number of neighbours first.
void branch_all(const Network& network, const CertifyOptions& options, const Stop& stop,
                WorkProgress& progress, std::vector<CertifiedBound>& bounds) {
  const Domain domain = clamped(network, options.domain);
  const auto is_any = [&](const CertifiedBound& bound) { return is_branched(options, bound); };
  const auto tasks = static_cast<int>(std::count_if(bounds.begin(), bounds.end(), is_any));
  TimeShares shares(stop, tasks, options.jobs);
  for (const bool are_counted : {false, true}) {
    const auto is_due = [&](const CertifiedBound& bound) {
      return is_branched(options, bound) && bound.neighbours.empty() != are_counted;
    };
    // Threads without a bound of their own work on the boxes of another bound.
    const auto due = static_cast<int>(std::count_if(bounds.begin(), bounds.end(), is_due));
    const int jobs_per_bound = files::thread_count(options.jobs) / std::max(due, 1);
    files::parallel_for(static_cast<int>(bounds.size()), options.jobs, [&](int i) {
      CertifiedBound& bound = bounds[static_cast<std::size_t>(i)];
      if (!is_due(bound)) return;
      const Stop share = shares.next();
      progress.run("branch and bound of " + called(bound), [&] {
        if (are_counted) start_from_any_number(bounds, bound);
        branch_further(network, domain, options, share, std::max(jobs_per_bound, 1), bound);
      });
    });
  }
}

/// Replaces `bound` by a smaller bound for inputs in `box` if the slopes of the activations there give one, by the
/// product of norms or by the matrix inequality.
/// @param box range of the moving input after the clamp. @param method kProduct: use the product only.
/// @param options `known` is taken from the bound.
/// @returns whether the matrix inequality was proved, whether or not its bound is smaller.
bool bound_by_slopes_on_box(const Network& network, const Box& box, const std::vector<CertifiedLayer>& layers,
                            UpperMethod method, SdpOptions options, CertifiedBound& bound) {
  const check::Intervals inputs = {{box.lower.begin(), box.lower.end()},
                                   {box.upper.begin(), box.upper.end()}};
  multiply_local_slopes(network, inputs, layers, bound);
  if (!has_program(method, bound) || !bound.has_slopes) return false;
  options.known = bound.upper;
  bound.sdp =
      bent_bound(check::chain_on_box(network, bound.function, bound.block, bound.scale, inputs), options);
  if (!bound.sdp.proof) return false;
  if (!(bound.sdp.proof->upper.value() < bound.upper.value())) return true;
  bound.upper = bound.sdp.proof->upper;
  bound.method = UpperMethod::kLocalSdp;
  bound.proof = std::move(bound.sdp.proof);
  bound.sdp.proof.reset();
  return true;
}

}  // namespace

int pieces_of_work(const CertifyOptions& options, int bounds) {
  return (searches_boxes(options) ? 4 : 3) * bounds;
}

void find_bounds(const Network& network, const CertifyOptions& options, const Stop& stop,
                 WorkProgress& progress, const std::vector<CertifiedLayer>& layers,
                 std::vector<CertifiedBound>& bounds) {
  const auto count = static_cast<int>(bounds.size());
  files::parallel_for(count, options.jobs, [&](int i) {
    CertifiedBound& bound = bounds[static_cast<std::size_t>(i)];
    progress.run("layer-wise bound of " + called(bound), [&] {
      if (has_program(options.method, bound) && bound.is_monotone) bound_layer_by_layer(network, bound);
    });
  });

  // Semidefinite programs and lower-bound searches form one flat list of independent tasks.
  const bool branches = searches_boxes(options);
  TimeShares shares(branches ? stop.after_share(kShareBeforeBranch) : stop, 2 * count, options.jobs);
  files::parallel_for(2 * count, options.jobs, [&](int i) {
    CertifiedBound& bound = bounds[static_cast<std::size_t>(i % count)];
    const Stop share = shares.next();
    if (i < count) {
      progress.run("search for steep slopes of " + called(bound),
                   [&] { search_below(network, options, share, options.lower.starts, bound); });
    } else {
      progress.run("semidefinite program of " + called(bound), [&] {
        const bool is_solved =
            bound.has_local_slopes && bound_by_slopes_on_box(network, box_of(network, options, bound), layers,
                                                             options.method, {share, {}}, bound);
        if (!is_solved && has_program(options.method, bound)) solve_program(network, options, share, bound);
      });
    }
  });
  if (branches) branch_all(network, options, stop, progress, bounds);
}

}  // namespace swarmcert::lipschitz
