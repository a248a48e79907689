// %% [markdown]
// # 03 Gate a release
//
// May this release ship? A policy states a limit for everything that the release depends on:
//
//     proved <= limit               pass
//     attained > limit              fail, with the witness
//     proved > limit >= attained    inconclusive: neither proved nor refuted
//
// Only a release that passes may fly.
//
// As commands:
//
// ```console
// $ swarmcert certify nn/networks/demo/network.toml -o cert.json
// ...
// $ printf '%s\n' 'schema = "swarmcert/policy/1"' '[release]' 'network = "nn/networks/demo/network.toml"' >policy.toml
// $ printf '%s\n' 'certificate = "cert.json"' '[certificate]' '[lipschitz]' 'max_joint_gf = 500' >>policy.toml
// $ swarmcert gate policy.toml --bundle evidence
// ...
//   lipschitz    pass               476.691           <= 500             -  gf/(m, m/s)  7
// ...
// verdict: pass
// ...
// $ swarmcert verify-bundle evidence
// ...
// accepted: evidence
// ...
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include "analysis/gate/gate.h"
#include "lipschitz/certify.h"
#include "nn/base/file_io.h"
#include "notebooks_cpp/notebook.h"

using namespace swarmcert;

/// A policy for the bundled network with this limit of the joint Lipschitz constant.
std::string policy_toml(double max_joint_gf) {
  return fmt::format(
      "schema = \"swarmcert/policy/1\"\n"
      "[release]\n"
      "network = \"nn/networks/demo/network.toml\"\n"
      "certificate = \"cert.json\"\n"
      "[certificate]\n"
      "[lipschitz]\n"
      "max_joint_gf = {}\n"
      "[spectral_norms]\n",
      max_joint_gf);
}

gate::GateResult judge(double max_joint_gf) {
  files::write_file("policy.toml", policy_toml(max_joint_gf), true);
  const gate::Policy policy = gate::read_policy("policy.toml");
  return gate::run_gate(policy, {});
}

int main() {
  const files::Network network = files::load_network({{}, "nn/networks/demo/network.toml", "", ""});
  lipschitz::CertifyOptions options;
  options.lower.rounds = 4;
  const lipschitz::Certification found = lipschitz::certify(network, options);
  files::write_file("cert.json", files::to_text(lipschitz::certificate(network, found)), true);

  for (const gate::Check& check : judge(500).checks)
    fmt::print("{:<16} {}\n", check.name, gate::name(check.verdict));

  // %% [markdown]
  // The same network under other limits. A release whose limit is neither proved nor violated does not pass either.

  // %%
  std::string data;
  for (const double limit : {500.0, 400.0, 200.0}) {
    const gate::GateResult result = judge(limit);
    for (const gate::Check& check : result.checks) {
      if (check.name != "lipschitz") continue;
      fmt::print("at most {:.0f}: {}, release: {}\n", limit, gate::name(check.verdict),
                 gate::name(result.verdict()));
      data += fmt::format("{} {:.4g} {}\n", limit, check.value.value_or(0), gate::name(check.verdict));
    }
  }
  notebook::plot("limits", data,
                 "set xlabel 'limit of the joint Lipschitz constant (gf per m, m/s)'\n"
                 "set ylabel 'proved (gf per m, m/s)'\nset xrange [0:600]\nset yrange [0:600]\nset grid\nset "
                 "key top left\n"
                 "plot x with lines dashtype 2 linecolor rgb '#999999' title 'limit', "
                 "'limits.dat' using 1:2 with points pointtype 7 linecolor rgb '#0072b2' title 'proved', "
                 "'' using 1:2:3 with labels offset 0,1 notitle\n");

  // %% [markdown]
  // One digit of the certificate is changed, here in the hash of the weights: the checker rejects the certificate, and the gate
  // the release.

  // %%
  std::string certificate = files::read_file("cert.json");
  const std::size_t digit = certificate.find("\"sha256\": \"") + 11;
  certificate[digit] = certificate[digit] == '0' ? '1' : '0';
  files::write_file("cert.json", certificate, true);
  const gate::GateResult damaged = judge(500);
  fmt::print("release: {}\n", gate::name(damaged.verdict()));
  for (const gate::Check& check : damaged.checks) {
    if (check.verdict != gate::Verdict::kPass)
      fmt::print("{:<16} {}: {}\n", check.name, gate::name(check.verdict), check.reason);
  }
}
