/// @file Readers of the policy's tables, one per kind of check; see CheckKind.
#pragma once

#include <functional>
#include <string>

#include "analysis/gate/policy.h"

namespace swarmcert::gate {

using Run = std::function<void(Evidence&, Checks&)>;

/// [hashes]: the files are the approved ones.
Run read_hashes(const files::TomlTable& table, Policy& policy);
/// [certificate]: accepted by the independent checker, for exactly these weights, in the precision used in flight.
void describe_certificate_keys(files::Keys& keys);
Run read_certificate(const files::TomlTable& table, Policy& policy);
/// [lipschitz]: proved Lipschitz constants: joint, per block, per function.
void describe_lipschitz_keys(files::Keys& keys);
Run read_lipschitz(const files::TomlTable& table, Policy& policy);
/// [spectral_norms]: spectral norm of every layer against the declared gamma.
void describe_spectral_norms_keys(files::Keys& keys);
Run read_spectral_norms(const files::TomlTable& table, Policy& policy);
/// [float32_error]: error of the evaluation in flight relative to the exact function, over the box.
void describe_float32_error_keys(files::Keys& keys);
Run read_float32_error(const files::TomlTable& table, Policy& policy);
/// [range]: values over the box, and the jump when a neighbour appears or disappears.
void describe_range_keys(files::Keys& keys);
Run read_range(const files::TomlTable& table, Policy& policy);
/// [theorem]: hypotheses and ball of the tracking theorem.
void describe_theorem_keys(files::Keys& keys);
Run read_theorem(const files::TomlTable& table, Policy& policy);
/// [tracking]: bound on the tracking error over the uncertainty of the vehicle, times the guard factor.
void describe_tracking_keys(files::Keys& keys);
Run read_tracking(const files::TomlTable& table, Policy& policy);
/// [small_gain]: margin of the small-gain condition of the swarm.
void describe_small_gain_keys(files::Keys& keys);
Run read_small_gain(const files::TomlTable& table, Policy& policy);
/// [match]: the exported source belongs to this network, file by file; the ELF file contains its weights and
/// evaluates as the network does.
void describe_match_keys(files::Keys& keys);
Run read_match(const files::TomlTable& table, Policy& policy);
/// Checks one file.
/// @param needs_app the ELF file must hold the Crazyflie app, whose flown code is compared too.
/// @throws files::InputError if the file or the network cannot be read.
Check match_row(Evidence& evidence, const std::string& name, int line, const std::string& path, bool is_elf,
                bool needs_app);
/// [firmware_facts]: flash, RAM, stack and times.
void describe_firmware_facts_keys(files::Keys& keys);
Run read_firmware_facts(const files::TomlTable& table, Policy& policy);
/// Describes firmware-facts.json, which [firmware_facts] reads.
void describe_firmware_facts_file(files::Keys& keys);
/// [residual]: error of the model on the reference flights.
void describe_residual_keys(files::Keys& keys);
Run read_residual(const files::TomlTable& table, Policy& policy);
/// [regression]: no value is worse than in the baseline by more than the stated percentage.
void describe_regression_keys(files::Keys& keys);
Run read_regression(const files::TomlTable& table, Policy& policy);

}  // namespace swarmcert::gate
