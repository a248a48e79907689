/// @file Certification of NET: upper and lower bounds on every layer's spectral norm and every function's Lipschitz
/// constant.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lipschitz/base/claims.h"
#include "lipschitz/branch/local_bound.h"
#include "lipschitz/checker/bounds.h"
#include "lipschitz/lower/lower_bound.h"
#include "lipschitz/upper/sdp_bound.h"
#include "lipschitz/upper/spectral_norm.h"
#include "lipschitz/values/value_bounds.h"
#include "nn/base/json.h"
#include "nn/base/record.h"
#include "nn/weights/network.h"
#include "nn/weights/samples.h"

namespace swarmcert::lipschitz {

enum class UpperMethod {
  /// The smallest bound by kProduct, kEclipseFast and kSdp; on a box also by kLocalProduct, kLocalSdp and kBranch.
  kAuto,
  kProduct,       ///< product of the layers' spectral norms
  kEclipseFast,   ///< layer by layer in closed form; the starting point of the semidefinite program
  kSdp,           ///< LipSDP-Neuron
  kLocalProduct,  ///< kProduct with the largest slopes of the activations on the box
  kLocalSdp,      ///< LipSDP-Neuron with the range of slopes of the activations on the box
  /// Branch and bound on the claim's box or, of ReLU networks, on a projective cover of all inputs; for rho: as kAuto.
  kBranch,
};

struct CertifyOptions : ClaimOptions {
  UpperMethod method = UpperMethod::kAuto;
  std::optional<files::GammaStatement> gamma;  ///< overrides what network.toml states
  BranchOptions branch;                        ///< per claim; certify() sets `known` and `cancelled`
  LowerBoundOptions lower;                     ///< per claim; certify() sets `cancelled`
  int jobs = 0;  ///< threads; 0: all. Results do not depend on it, unless `seconds` is set.
  /// Wall-clock limit for the whole certification, divided among its tasks; 0: no limit. The work that is always done
  /// may exceed it: the spectral norms and layer-wise bounds at the start, and one exact proof per bound at the end.
  double seconds = 0;
  const std::atomic<bool>* cancelled = nullptr;  ///< ends the searches; upper bounds found so far are kept
  std::function<void(int done, int total, const std::string& what)> progress;  ///< called from any thread
};

struct CertifiedLayer {
  files::FunctionId network;  ///< "network", "phi:<kind>" or "rho:<kind>"
  std::string name;           ///< the layer's name in its file
  SpectralNorm norm;
  /// Whether the layer satisfies the stated gamma: proved, refuted or inconclusive. Nothing if no gamma was stated or
  /// the layer is not stored in the file.
  std::optional<Verdict> respects_gamma;
};

struct CertifiedBound : Claim {
  bool is_relu = true;     ///< all activations are ReLU; else no branch and bound without a box
  bool has_slopes = true;  ///< activations act entry by entry; false: a layer sorts, and no bound is of a box
  bool has_local_slopes = false;  ///< a box, and an activation other than ReLU: slopes may be smaller there
  bool is_monotone = true;        ///< false: some slope is negative, or a layer sorts; no layer-wise bound
  UpperBound upper{0};
  UpperMethod method = UpperMethod::kProduct;
  std::optional<UpperProof> proof;  ///< set if method is kEclipseFast, kSdp or kLocalSdp
  std::optional<LocalProof> local;  ///< set if method is kBranch
  int nodes = 0;                    ///< boxes examined by branch and bound
  BranchStop branch_stop = BranchStop::kNothingRun;
  Outlook outlook;        ///< set if nodes > 0
  UpperBound product{0};  ///< product of spectral norms, for comparison
  SdpBound sdp;           ///< outcome of the semidefinite program; its proof is moved to `proof`
  FoundSlope lower;       ///< proves the lower bound

  /// Returns whether more time might have given a smaller upper bound or a larger lower bound, because a signal or the
  /// time limit stopped a search. Both bounds are proved in either case.
  bool is_interrupted() const {
    const bool above = branch_stop == BranchStop::kNothingRun ? lipschitz::is_interrupted(sdp.stop)
                                                              : lipschitz::is_interrupted(branch_stop);
    return above || lower.interrupted;
  }
};

struct CertifiedLaw : LawClaim {
  std::string domain = "global";  ///< "box" if any bound it depends on holds on the box only
  UpperBound upper{0};
  bool interrupted = false;  ///< the search for one of the bounds it depends on was interrupted
};

struct Certification {
  std::optional<files::GammaStatement> gamma;
  bool as_float32 = false;  ///< the network was rounded to float32 beforehand; for the certificate
  Domain domain;
  std::map<files::FunctionId, files::SampleAgreement>
      samples;  ///< by part: the samples it was compared with; for the certificate
  std::vector<CertifiedLayer> layers;
  /// The matrices as stored, of networks whose layers are not these (Weights::stored). Limits on norms are judged here.
  std::vector<CertifiedLayer> stored;
  std::vector<CertifiedBound> bounds;
  std::vector<CertifiedLaw> laws;
  std::vector<CertifiedValues> values;  ///< for the certificate; from certified_values()
};

/// Relative deviation from gamma up to which a norm counts as equal to it: the error of float32 storage with a small
/// margin.
inline constexpr double kEqualTolerance = 0x1p-20;

/// Returns for each layer of one network whether the norms satisfy the stated gamma.
/// Scope layer: |W|_2 <= gamma. Scope network, mode clip: the product of the norms is at most gamma; all layers get the
/// same verdict. Scope network, mode equal: each norm equals gamma^(1/layers). Mode equal requires the lower bound on
/// the norm as well as the upper one, both up to kEqualTolerance. Decided in exact arithmetic; inconclusive if the
/// limit lies inside an enclosure.
std::vector<Verdict> respects_gamma(const files::GammaStatement& gamma, const std::vector<Enclosure>& norms);

/// Returns the norms that are stated to users: those of the stored matrices, in order of evaluation.
std::vector<CertifiedLayer> stated_norms(const files::Network& network, const Certification& certification);

/// Certifies all functions of NET.
///
/// Upper bounds hold in exact arithmetic for the weights as stored, over all inputs and hence over every box. Lower
/// bounds are slopes between two float32 points: exact, or rounded down for smooth activations (checker/witness.h). The
/// input clamp of NET never increases a distance, so upper bounds remain valid with it.
///
/// Functions with activations other than ReLU are bounded above by the same matrix inequality if the activation is
/// monotone (checker/stages.h), otherwise by its extension up to the size stated in bent_bound.h; on a box also by the
/// slopes of the activations there. If NET is silent in some compositions, bounds hold while the neighbours stay the
/// same, and lower bounds use compositions in which it is not silent.
///
/// Branch and bound runs on the image of the box under the clamp or, of ReLU networks and if requested, on a projective
/// cover of all inputs.
/// @throws std::invalid_argument if gamma is not positive; if branch and bound is requested without a box and an
///   activation is not ReLU; or as claims() and law_claims().
Certification certify(const files::Network& network, const CertifyOptions& options);

/// Returns the bound that a law yields from verified bounds of its terms, rounded up.
/// @param terms pairs of the bound for one neighbour and the number of such neighbours.
UpperBound law_bound(LawKind law, const std::vector<std::pair<UpperBound, int>>& terms);

/// The statement of a claim or a law without its proof: the fields shared by results and certificates.
struct BoundSummary {
  std::string function, domain, block, law, norm;
  std::optional<std::vector<double>> scale;  ///< of a claim
  std::string unit;
  double upper = 0;
  std::string upper_method, status;
  std::optional<double> lower;
  std::optional<Neighbours> neighbours;
};
BoundSummary summary(const files::Network& network, const CertifiedBound& bound);
BoundSummary summary(const files::Network& network, const CertifiedLaw& law);
void describe(files::Record& record, const BoundSummary& summary);

/// Returns the certificate of a certification: the network and everything that check::check() needs.
files::Json certificate(const files::Network& network, const Certification& certification);
/// Describes the file.
void describe_certificate_file(files::Record& record);

/// Returns whether the search for any of the bounds was interrupted.
bool is_interrupted(const Certification& certification);
/// "finished" or "interrupted".
const char* status(bool is_interrupted);

/// "auto", "product", "eclipse_fast", "sdp", "local_product", "local_sdp", "branch".
const char* name(UpperMethod method);

/// Returns whether bounds by this method hold on the box only, if the claim has one.
constexpr bool is_local(UpperMethod method) {
  return method == UpperMethod::kBranch || method == UpperMethod::kLocalProduct ||
         method == UpperMethod::kLocalSdp;
}

}  // namespace swarmcert::lipschitz
