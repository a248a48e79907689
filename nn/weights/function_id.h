/// @file Identifies a function of NET: a plain network, a part of a deep set, or rho of a sum.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace swarmcert::files {

/// The kind of the phi that models the ground. Its input is the vehicle's own state, and it is always part of the sum.
inline constexpr const char* kGroundKind = "ground";

/// Name of a function of NET, also used in certificates, JSON and options: "network" is a plain network, "phi:<kind>"
/// and "rho:<kind>" are the parts of a deep set, and "set:<phi kind>:<rho kind>" is rho of a sum that contains phi.
/// Class invariant: a kind does not contain ':'. Ordered by name.
class FunctionId {
 public:
  FunctionId() = default;  ///< the plain network
  /// Implicit, since functions are written as text.
  /// @throws std::invalid_argument if `name` does not have one of these forms.
  FunctionId(const std::string& name);                             // NOLINT
  FunctionId(const char* name) : FunctionId(std::string(name)) {}  // NOLINT

  /// Parses text from users and certificates; returns nothing if `name` does not have one of these forms.
  static std::optional<FunctionId> parse(const std::string& name);

  /// @throws std::invalid_argument if a kind contains ':'.
  static FunctionId phi(const std::string& kind) { return "phi:" + kind; }
  static FunctionId rho(const std::string& kind) { return "rho:" + kind; }
  static FunctionId set(const std::string& phi_kind, const std::string& rho_kind) {
    return "set:" + phi_kind + ":" + rho_kind;
  }
  static FunctionId ground_phi() { return phi(kGroundKind); }

  const std::string& name() const { return name_; }

  bool is_plain() const { return form_ == Form::kPlain; }
  bool is_phi() const { return form_ == Form::kPhi; }
  bool is_rho() const { return form_ == Form::kRho; }
  bool is_set() const { return form_ == Form::kSet; }
  bool is_ground_phi() const { return is_phi() && phi_kind_ == kGroundKind; }
  /// Returns true if the function maps inputs to outputs: a plain network or a set function.
  bool is_whole() const { return is_plain() || is_set(); }

  const std::string& phi_kind() const { return phi_kind_; }  ///< of a phi or a set function; otherwise empty
  const std::string& rho_kind() const { return rho_kind_; }  ///< of a rho or a set function; otherwise empty
  /// Returns the kind of a phi or a rho.
  const std::string& kind() const { return is_rho() ? rho_kind_ : phi_kind_; }

  /// The stored networks that take the inputs and give the outputs: phi and rho of a set function, otherwise the
  /// function itself.
  FunctionId input_part() const { return is_set() ? phi(phi_kind_) : *this; }
  FunctionId output_part() const { return is_set() ? rho(rho_kind_) : *this; }
  /// Returns the stored networks in order of evaluation: one, or two for a set function.
  std::vector<FunctionId> parts() const;

  friend bool operator==(const FunctionId& a, const FunctionId& b) { return a.name_ == b.name_; }
  friend bool operator!=(const FunctionId& a, const FunctionId& b) { return a.name_ != b.name_; }
  friend bool operator<(const FunctionId& a, const FunctionId& b) { return a.name_ < b.name_; }
  friend std::ostream& operator<<(std::ostream& out, const FunctionId& function);

 private:
  enum class Form { kPlain, kPhi, kRho, kSet };

  std::string name_ = "network";
  Form form_ = Form::kPlain;
  std::string phi_kind_, rho_kind_;
};

}  // namespace swarmcert::files
