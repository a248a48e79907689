// %% [markdown]
// # 01 Certify a file
//
// How fast can the output of the networks in these files change, provably?
//
//     |f(x) - f(y)| <= L |x - y|  for all x, y
//     L <= |W_1| |W_2| ... |W_K|                      product of spectral norms
//     L <= sqrt(rho) where M(rho, T) <= 0, T >= 0     LipSDP-Neuron: usually much smaller
//     L >= |f(x) - f(y)| / |x - y|                    any two points
//
// Upper bounds are proved in exact arithmetic, lower bounds are slopes between two float32 points.
//
// A state dict contains weights, but neither the order of its layers nor the operations between them. Record outputs of the
// trained network, and `certify net.pth --samples samples.npz` refuses a file that represents any other function because of a
// different order, activation or skip connection:
//
//     import numpy, torch
//     model.eval()
//     with torch.no_grad():
//         x = 4 * torch.rand(1000, 6) - 2
//         numpy.savez("samples.npz", inputs=x.numpy(), outputs=model(x).numpy())
//
// As commands:
//
// ```console
// $ swarmcert certify nn/networks/demo/network.toml -o cert.json
// ...
//   set:small:small     476.6906052  sdp         2791.3694       297.08258   1.605  gf/(m, m/s)
// ...
// verdict: proved for phi:small, rho:small: fc1 - ReLU - fc2 - ReLU - fc3 - ReLU - fc4
// $ swarmcert check cert.json nn/networks/demo/network.toml
// accepted: every statement verified in exact arithmetic: 8 spectral norms, 3 upper bounds, 3 lower bounds
// ...
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "nn/base/content_hash.h"
#include "notebooks_cpp/notebook.h"

using namespace swarmcert;

int main() {
  const files::Network network = files::load_network({{}, "nn/networks/demo/network.toml", "", ""});
  lipschitz::CertifyOptions options;
  options.lower.rounds = 4;  // a short search for steep slopes
  const lipschitz::Certification found = lipschitz::certify(network, options);

  // %% [markdown]
  // Every layer was trained to keep its spectral norm at or below gamma = 3. Do the stored weights satisfy this?

  // %%
  for (const lipschitz::CertifiedLayer& layer : found.layers) {
    fmt::print("{:<10} {}  {:.6f} .. {:.6f}  {}\n", layer.network.name(), layer.name,
               layer.norm.norm.lower.value(), layer.norm.norm.upper.value(),
               lipschitz::name(*layer.respects_gamma));
  }

  // %% [markdown]
  // The bounds. The set function is rho(sum of phi); its input is the neighbour that moves.

  // %%
  std::string data;
  for (const lipschitz::CertifiedBound& bound : found.bounds) {
    const double witnessed = bound.lower.witness->slope.value();
    fmt::print("{:<16} {:8.2f} <= L <= {:8.2f}   (product of norms: {:.1f})\n", bound.function.name(),
               witnessed, bound.upper.value(), bound.product.value());
    data += fmt::format("\"{}\" {:.3f} {:.4g} {:.4g}\n", bound.function.name(), witnessed,
                        bound.upper.value(), bound.product.value());
  }
  notebook::plot("bounds", data,
                 "set style data histogram\nset style fill solid 0.8\nset logscale y\nset key top left\n"
                 "set ylabel 'Lipschitz constant (gf, hidden units per m, m/s)'\n"
                 "plot 'bounds.dat' using 2:xtic(1) title 'witnessed' linecolor rgb '#0072b2', "
                 "'' using 3 title 'proved' linecolor rgb '#d55e00', "
                 "'' using 4 title 'product of norms' linecolor rgb '#999999'\n");

  // %% [markdown]
  // The certificate contains the proofs. A small checker verifies it against the weights and does not trust the optimiser. A
  // bound one percent lower may be true, but the proof does not support it, even with a recomputed hash.

  // %%
  files::Json certificate = lipschitz::certificate(network, found);
  const check::CheckResult sound = check::check(certificate, network);
  fmt::print("as written: {}\n", sound.accepted ? "accepted" : "refused");

  const double upper = 0.99 * found.bounds[0].upper.value();
  certificate["bounds"][0]["upper"] = upper;
  certificate["bounds"][0]["upper_hex"] = files::hex_float(upper);
  certificate["bounds"][0]["proof"]["rho"] = files::hex_float(0.999 * upper * upper);
  certificate["content_sha256"] = files::content_sha256(certificate);
  const check::CheckResult forged = check::check(certificate, network);
  fmt::print("forged:     {}: {}\n", forged.accepted ? "accepted" : "refused", forged.reason);
}
