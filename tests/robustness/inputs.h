/// @file Small valid inputs of every kind, for runs of the whole tool.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "analysis/run.h"

namespace swarmcert::tests {

/// Copies and creates in `folder`: phi.safetensors, rho.safetensors, network.toml, box.toml, gains.toml, model.toml,
/// grid.toml, flights/<run>/cf<vehicle>_00, log.csv, cert.json (of phi), set.json (of the network), firmware/,
/// policy.toml of a release that passes with its baseline.json and its bundle/, and swept/, two shards of the grid.
/// `small`: uses networks with four neurons per layer instead of the demo's, for which every proof takes less than a
/// second.
inline void make_inputs(const std::filesystem::path& folder, bool small = false) {
  const std::filesystem::path source = SWARMCERT_SOURCE_DIR;
  for (const char* name : {"phi.safetensors", "rho.safetensors", "network.toml", "box.toml"})
    std::filesystem::copy_file(source / "nn/networks/demo" / name, folder / name);
  std::filesystem::copy_file(source / "controller/gains/crazyflie-small.toml", folder / "gains.toml");
  std::filesystem::copy_file(source / "stability/models/crazyflie-small-effects.toml", folder / "model.toml");
  write_text((folder / "grid.toml").string(),
             "schema = \"swarmcert/grid/1\"\ngains = \"gains.toml\"\nmodel = \"model.toml\"\naxis = \"z\"\n"
             "compute = [\"amplitude\", \"impulse\"]\npareto = [\"impulse\"]\n[axes]\n"
             "Kp = {from = 2, to = 40, steps = 3, scale = \"log\"}\nKd = {from = 2, to = 20, steps = 2}\n");
  write_text(
      (folder / "policy.toml").string(),
      "schema = \"swarmcert/policy/1\"\n[release]\nnetwork = \"network.toml\"\ncertificate = \"set.json\"\n"
      "gains = \"gains.toml\"\nmodel = \"model.toml\"\nsource = \"firmware/swarmcert_network.cpp\"\n"
      "flights = [\"flights\"]\nlogs = 6\n[certificate]\n[lipschitz]\nmax_joint_gf = 5000\n[spectral_norms]\n"
      "[tracking]\nover = \"corners\"\nmax_error_m = 5\n[match]\n[residual]\nmax_rmse_N = 0.1\n"
      "[regression]\nmax_increase_percent = 5\n");
  const Outcome made = run_shell(
      "for run in 1 2 3; do swarmcert simulate random-walk --vehicles 2 --duration 14 --model model.toml "
      "--gains gains.toml --seed $run -o flights/$run -q || exit 1; done >/dev/null; " +
          std::string(
              small
                  ? "swarmcert train model.toml flights --phi 4 --rho 4 --features 4 --epochs 1 -o small -q "
                    ">/dev/null && mv small/phi_small.safetensors phi.safetensors && "
                    "mv small/rho_small.safetensors rho.safetensors && "
                  : "") +
          "swarmcert inspect flights/1/cf1_00 --csv log.csv >/dev/null && swarmcert certify phi.safetensors "
          "--nodes 1 -q -o cert.json >/dev/null && swarmcert certify network.toml --nodes 0 --method product "
          "-q -o set.json >/dev/null && swarmcert export network.toml -o firmware >/dev/null && swarmcert "
          "gate policy.toml --baseline baseline.json --update-baseline --bundle bundle -q >/dev/null && for "
          "shard in 1/2 2/2; do swarmcert sweep grid.toml -o swept --shard $shard -q || exit 1; done "
          ">/dev/null",
      folder);
  ASSERT_EQ(made.exit_code, 0) << made.output;
}

}  // namespace swarmcert::tests
