/// @file How the functions that NET contains are named, in certificates, JSON and options.
///
/// "network" is a plain network, "phi:<kind>" and "rho:<kind>" are the parts of a deep set, and
/// "set:<phi kind>:<rho kind>" is rho of a sum that contains phi. A kind contains no ':'.
#pragma once

#include <string>

namespace swarmcert::files {

/// The name of a plain network.
inline constexpr const char* kPlainNetwork = "network";
/// The kind of phi that models the ground: its input is the vehicle's own state, and it always enters the sum.
inline constexpr const char* kGroundKind = "ground";
/// Its part phi.
inline constexpr const char* kGroundPhi = "phi:ground";

inline std::string phi_name(const std::string& kind) { return "phi:" + kind; }
inline std::string rho_name(const std::string& kind) { return "rho:" + kind; }
inline std::string set_name(const std::string& phi_kind, const std::string& rho_kind) {
  return "set:" + phi_kind + ":" + rho_kind;
}

inline bool is_phi(const std::string& function) { return function.rfind("phi:", 0) == 0; }
inline bool is_rho(const std::string& function) { return function.rfind("rho:", 0) == 0; }
inline bool is_set(const std::string& function) { return function.rfind("set:", 0) == 0; }
/// True for what maps inputs to outputs: a plain network, or a set function.
inline bool is_whole(const std::string& function) { return function == kPlainNetwork || is_set(function); }

/// The kind of a part, "phi:<kind>" or "rho:<kind>".
inline std::string kind_of(const std::string& part) { return part.substr(4); }

}  // namespace swarmcert::files
