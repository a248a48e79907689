/// @file Which function of NET: a plain network, a part of a deep set, or rho of a sum.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace swarmcert::files {

/// The kind of phi that models the ground: its input is the vehicle's own state, and it always enters the sum.
inline constexpr const char* kGroundKind = "ground";

/// Names a function of NET, in certificates, JSON and options as well: "network" is a plain network, "phi:<kind>" and
/// "rho:<kind>" are the parts of a deep set, and "set:<phi kind>:<rho kind>" is rho of a sum that contains phi.
/// Class invariant: a kind contains no ':'. Ordered by name.
class FunctionId {
 public:
  FunctionId() = default;  ///< the plain network
  /// Not explicit, since text is how functions are written down.
  /// @throws std::invalid_argument if `name` is not of one of these forms.
  FunctionId(const std::string& name);                             // NOLINT
  FunctionId(const char* name) : FunctionId(std::string(name)) {}  // NOLINT

  /// Nothing if `name` is not of one of these forms: for text of users and of certificates.
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
  /// True for what maps inputs to outputs: a plain network, or a set function.
  bool is_whole() const { return is_plain() || is_set(); }

  const std::string& phi_kind() const { return phi_kind_; }  ///< of a phi or a set function; else empty
  const std::string& rho_kind() const { return rho_kind_; }  ///< of a rho or a set function; else empty
  /// The kind of a phi or a rho.
  const std::string& kind() const { return is_rho() ? rho_kind_ : phi_kind_; }

  /// The stored network that takes the inputs, and the one that gives the outputs: phi and rho of a set function, else
  /// the function itself.
  FunctionId input_part() const { return is_set() ? phi(phi_kind_) : *this; }
  FunctionId output_part() const { return is_set() ? rho(rho_kind_) : *this; }
  /// The stored networks that it passes through, first to last: one, or of a set function two.
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
