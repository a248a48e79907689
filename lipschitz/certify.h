/// @file Certification of NET: every layer's spectral norm, every function's Lipschitz constant, from both sides.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/bounds.h"
#include "lipschitz/sdp_bound.h"
#include "lipschitz/slope_search.h"
#include "lipschitz/spectral_norm.h"
#include "nn/files/json.h"
#include "nn/files/network.h"

namespace swarmcert::lipschitz {

enum class UpperMethod {
  kAuto,     ///< the smaller of both
  kProduct,  ///< product of the layers' spectral norms
  kSdp,      ///< LipSDP-Neuron
};

struct CertifyOptions {
  UpperMethod method = UpperMethod::kAuto;
  std::optional<files::GammaStatement> gamma;  ///< overrides what network.toml states
  std::uint64_t seed = 1;                      ///< of the search for lower bounds
  /// Per function; 0: no lower bounds. Nothing: kDefaultSearchRounds, fewer for networks much larger than the paper's,
  /// for which a round takes longer.
  std::optional<int> search_rounds;
  double search_seconds = 0;                     ///< per function; stops at the end of a round; 0: no limit
  int jobs = 0;                                  ///< threads; 0: all. Results do not depend on it.
  const std::atomic<bool>* cancelled = nullptr;  ///< upper bounds found so far are kept
  std::function<void(int done, int total, const std::string& what)> progress;  ///< called from any thread
};

struct CertifiedLayer {
  std::string network;  ///< "network", "phi:<kind>" or "rho:<kind>"
  std::string name;     ///< the layer's name in its file
  SpectralNorm norm;
  /// Whether the layer satisfies what was stated of gamma: proved, refuted, inconclusive; nothing where nothing was.
  std::optional<Verdict> respects_gamma;
};

struct CertifiedBound {
  std::string function;  ///< "network", "phi:<kind>", "rho:<kind>" or "set:<phi kind>:<rho kind>"
  UpperBound upper{
      0};  ///< over all inputs, Euclidean norms; for a set: per neighbour that moves, any number of them
  UpperMethod method = UpperMethod::kProduct;
  std::optional<UpperProof> proof;      ///< where method is kSdp
  UpperBound product{0};                ///< product of spectral norms, for comparison
  SdpBound sdp;                         ///< how the semidefinite program went; its proof is moved to `proof`
  std::optional<SlopeWitness> witness;  ///< proves the lower bound
  int search_rounds = 0;                ///< that the search for it ran
  std::vector<std::string> other_networks;  ///< of witness->others, "phi:<kind>" each
};

struct Certification {
  std::optional<files::GammaStatement> gamma;
  std::vector<CertifiedLayer> layers;
  std::vector<CertifiedBound> bounds;
};

/// How far from gamma a norm may lie, relatively, to count as equal to it: what float32 storage costs, and a little.
inline constexpr double kEqualTolerance = 0x1p-20;

/// Whether a layer's norm satisfies |W|_2 <= gamma (scope layer) or |W|_2^layers <= gamma (scope network: an equal
/// share), and with mode kEqual also the converse, then both up to kEqualTolerance. Decided in exact arithmetic;
/// inconclusive where the enclosure straddles the limit.
/// @param layers of the network that the layer belongs to.
Verdict respects_gamma(const files::GammaStatement& gamma, const Enclosure& norm, std::size_t layers);

/// Certifies NET as a whole. Upper bounds hold in exact arithmetic for the weights as stored, over all inputs; lower
/// bounds are exact slopes between two float32 points. The clamp of NET, which never increases a distance, leaves the
/// upper bounds valid.
/// @throws std::invalid_argument if gamma is not positive.
Certification certify(const files::Network& network, const CertifyOptions& options);

/// The certificate of what was found: everything that check::check() needs besides the weights.
files::Json certificate(const files::Network& network, const Certification& certification);

/// "auto", "product", "sdp".
const char* name(UpperMethod method);

}  // namespace swarmcert::lipschitz
