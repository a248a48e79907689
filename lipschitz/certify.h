/// @file Certification of NET: every layer's spectral norm, every function's Lipschitz constant, from both sides.
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
#include "nn/weights/network.h"
#include "nn/weights/samples.h"

namespace swarmcert::lipschitz {

enum class UpperMethod {
  kAuto,     ///< the smallest of the next three; with a box, of activations besides ReLU, of the two after
  kProduct,  ///< product of the layers' spectral norms
  kEclipseFast,   ///< layer by layer in closed form; what the semidefinite program starts from
  kSdp,           ///< LipSDP-Neuron
  kLocalProduct,  ///< the product with the steepest slopes that the activations have on the box
  kLocalSdp,      ///< LipSDP-Neuron with the slopes that they have on the box
  kBranch,  ///< branch and bound on the claim's box, or, for all inputs, on a projective cover; kAuto for rho
};

struct CertifyOptions : ClaimOptions {
  UpperMethod method = UpperMethod::kAuto;
  std::optional<files::GammaStatement> gamma;  ///< overrides what network.toml states
  BranchOptions branch;                        ///< per claim; `known` and `cancelled` are taken from here
  LowerBoundOptions lower;                     ///< its `cancelled` is taken from here below
  int jobs = 0;  ///< threads; 0: all. Results do not depend on it, unless `seconds` is set.
  /// Wall clock for all of it, shared out among its parts; 0: no limit. Exceeded by what has to be proved in any case:
  /// the spectral norms and the layer-wise bounds before, one exact proof per bound after.
  double seconds = 0;
  const std::atomic<bool>* cancelled = nullptr;  ///< ends the searches; upper bounds found so far are kept
  std::function<void(int done, int total, const std::string& what)> progress;  ///< called from any thread
};

struct CertifiedLayer {
  files::FunctionId network;  ///< "network", "phi:<kind>" or "rho:<kind>"
  std::string name;           ///< the layer's name in its file
  SpectralNorm norm;
  /// Whether the layer satisfies what was stated of gamma: proved, refuted, inconclusive; nothing where nothing was, or
  /// the layer is none of the file.
  std::optional<Verdict> respects_gamma;
};

struct CertifiedBound : Claim {
  bool has_witness = true;  ///< of relative states; otherwise there is no lower bound
  bool is_relu = true;      ///< and by ReLU alone; otherwise there is no branch and bound
  bool has_slopes = true;   ///< number by number; otherwise a layer is sorted, and the product is the bound
  bool has_local_slopes = false;  ///< a box, and an activation besides ReLU: its slopes there may be smaller
  bool is_monotone = true;        ///< otherwise the layer-wise bound is that of the product
  UpperBound upper{0};
  UpperMethod method = UpperMethod::kProduct;
  std::optional<UpperProof> proof;  ///< where method is kEclipseFast, kSdp or kLocalSdp
  std::optional<LocalProof> local;  ///< where method is kBranch
  int nodes = 0;                    ///< boxes that branch and bound looked at
  BranchStop branch_stop = BranchStop::kNothingRun;
  Outlook outlook;        ///< where nodes > 0
  UpperBound product{0};  ///< product of spectral norms, for comparison
  SdpBound sdp;           ///< how the semidefinite program went; its proof is moved to `proof`
  FoundSlope lower;       ///< proves the lower bound

  /// Whether more time might have given a smaller upper or a larger lower bound: a search was stopped by a signal or by
  /// the time. Both bounds are proved all the same.
  bool is_interrupted() const {
    const bool above = branch_stop == BranchStop::kNothingRun ? lipschitz::is_interrupted(sdp.stop)
                                                              : lipschitz::is_interrupted(branch_stop);
    return above || lower.interrupted;
  }
};

struct CertifiedLaw : LawClaim {
  std::string domain = "global";  ///< "box" where a bound that it rests on holds there only
  UpperBound upper{0};
  bool interrupted = false;  ///< one of the bounds that it rests on is
};

struct Certification {
  std::optional<files::GammaStatement> gamma;
  bool as_float32 = false;  ///< the network was rounded to float32 before; for the certificate
  Domain domain;
  std::map<files::FunctionId, files::SampleAgreement>
      samples;  ///< by part: what it was held against; for the certificate
  std::vector<CertifiedLayer> layers;
  std::vector<CertifiedBound> bounds;
  std::vector<CertifiedLaw> laws;
  std::vector<CertifiedValues> values;  ///< for the certificate; from certified_values()
};

/// How far from gamma a norm may lie, relatively, to count as equal to it: what float32 storage costs, and a little.
inline constexpr double kEqualTolerance = 0x1p-20;

/// Whether the norms of one network's layers satisfy what was stated of gamma, layer by layer. Scope layer: |W|_2 <=
/// gamma. Scope network, mode clip: the product of the norms is at most gamma; one verdict for all layers. Scope
/// network, mode equal: each is the equal share, gamma^(1/layers). Mode equal asks for the converse as well, both up to
/// kEqualTolerance. Decided in exact arithmetic; inconclusive where an enclosure straddles its limit.
std::vector<Verdict> respects_gamma(const files::GammaStatement& gamma, const std::vector<Enclosure>& norms);

/// Certifies NET as a whole. Upper bounds hold in exact arithmetic for the weights as stored, over all inputs and so
/// over every box; lower bounds are slopes between two float32 points, exact or, of smooth activations, rounded down
/// (checker/witness.h). The clamp of NET, which never increases a distance, leaves the upper bounds valid. Functions
/// with other activations than ReLU are bounded above by the same matrix inequality where the activation is monotone
/// (checker/stages.h), else, up to the size that bent_bound.h states, by its extension; on a box also from the slopes
/// that the activations have there. Set functions of rotation invariants get upper bounds only: those of rho(sum phi)
/// times the Lipschitz constant of the map to invariants. Where NET is silent in some compositions, bounds hold while
/// the neighbours stay the same, and lower ones are among neighbours where it is not. Branch and bound is for ReLU. It
/// runs on what the clamp lets through of the box, or on a projective cover of all inputs where there is no box.
/// @throws std::invalid_argument if gamma is not positive, if branch and bound is asked for and an activation is not
///   ReLU, if there is a domain or branch and bound is asked for and NET has invariants, or as claims() and
///   law_claims().
Certification certify(const files::Network& network, const CertifyOptions& options);

/// What the law gives from verified bounds of its terms, rounded up.
/// @param terms bound of one neighbour and number of such neighbours.
UpperBound law_bound(LawKind law, const std::vector<std::pair<UpperBound, int>>& terms);

/// What a claim and a law say, without proofs: the fields that JSON results and certificates share.
files::Json summary(const files::Network& network, const CertifiedBound& bound);
files::Json summary(const files::Network& network, const CertifiedLaw& law);

/// The certificate of what was found: everything that check::check() needs besides the weights.
files::Json certificate(const files::Network& network, const Certification& certification);

/// Whether a search for any of the bounds was.
bool is_interrupted(const Certification& certification);
/// "finished" or "interrupted".
const char* status(bool is_interrupted);

/// "auto", "product", "eclipse_fast", "sdp", "local_product", "local_sdp", "branch".
const char* name(UpperMethod method);

/// Whether bounds by this method hold on the box only, where there is one.
constexpr bool is_local(UpperMethod method) {
  return method == UpperMethod::kBranch || method == UpperMethod::kLocalProduct ||
         method == UpperMethod::kLocalSdp;
}

}  // namespace swarmcert::lipschitz
