/// @file What the names of layers say: their numbers, the module that they belong to, and gaps in the numbers.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::files {

/// Natural sort order: compares runs of digits by value, so that fc2 comes before fc10.
bool naturally_before(const std::string& a, const std::string& b);

/// Returns whether a number puts `a` before `b`: both names have a number where they first differ.
bool numbered_before(const std::string& a, const std::string& b);

/// Returns whether `name` is `prefix` or lies in it: "actor" contains "actor.0" and "actor1", but not "actor_target.0".
bool has_prefix(const std::string& name, const std::string& prefix);

/// Returns the prefixes that tell the modules of `layers` apart: {"actor", "critic"} for "actor.0", "critic.0" and for
/// "actor_fc1", "critic_fc1" the stems {"actor_fc", "critic_fc"}. One prefix, possibly empty: all layers belong
/// together, as "fc1", "fc2", "out" do.
std::vector<std::string> modules_of(const std::vector<std::string>& layers);

/// Returns why the numbers in the names of a chain may hide a missing layer or another nesting: they do not begin with
/// 0 or 1, do not have equal distances ("0", "2", "6"), or count in several places ("q1.0", "q2.0"). Empty: they do
/// not. Names without a number are left aside.
std::string gap_in_numbers(const std::vector<std::string>& layers);

}  // namespace swarmcert::files
