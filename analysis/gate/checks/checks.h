/// @file Readers of the policy's tables, one per kind of check; see CheckKind.
#pragma once

#include <functional>
#include <string>

#include "analysis/gate/policy.h"

namespace swarmcert::gate {

using Run = std::function<void(Evidence&, Checks&)>;

/// [hashes]: files are the ones that were approved.
Run read_hashes(const files::TomlTable& table, Policy& policy);
/// [certificate]: accepted by the independent checker, of exactly these weights, in the flown precision.
Run read_certificate(const files::TomlTable& table, Policy& policy);
/// [lipschitz]: proved Lipschitz constants, joint, per block, per function.
Run read_lipschitz(const files::TomlTable& table, Policy& policy);
/// [spectral_norms]: of every layer, against the declared gamma.
Run read_spectral_norms(const files::TomlTable& table, Policy& policy);
/// [float32_error]: what flies against the exact function, over the box.
Run read_float32_error(const files::TomlTable& table, Policy& policy);
/// [range]: values over the box, and the jump where a neighbour comes or goes.
Run read_range(const files::TomlTable& table, Policy& policy);
/// [theorem]: hypotheses of the tracking theorem, and its ball.
Run read_theorem(const files::TomlTable& table, Policy& policy);
/// [tracking]: bound on the tracking error over the vehicle's uncertainty, times the guard factor.
Run read_tracking(const files::TomlTable& table, Policy& policy);
/// [small_gain]: margin of the swarm's loop of bounds.
Run read_small_gain(const files::TomlTable& table, Policy& policy);
/// [match]: the exported source is that of this network, file by file; the ELF holds its weights and evaluates as it
/// does.
Run read_match(const files::TomlTable& table, Policy& policy);
/// Of one file. @throws files::InputError if it, or the network, cannot be read.
Check match_row(Evidence& evidence, const std::string& name, int line, const std::string& path, bool is_elf);
/// [firmware_facts]: flash, RAM, stack and times.
Run read_firmware_facts(const files::TomlTable& table, Policy& policy);
/// [residual]: the model against the reference flights.
Run read_residual(const files::TomlTable& table, Policy& policy);
/// [regression]: nothing is worse than in the baseline by more than so many percent.
Run read_regression(const files::TomlTable& table, Policy& policy);

}  // namespace swarmcert::gate
