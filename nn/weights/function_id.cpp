#include "nn/weights/function_id.h"

#include <ostream>
#include <stdexcept>

namespace swarmcert::files {

std::optional<FunctionId> FunctionId::parse(const std::string& name) {
  FunctionId function;
  if (name == function.name_) return function;
  if (name.size() < 4) return std::nullopt;
  function.name_ = name;
  const std::string form = name.substr(0, 4), kinds = name.substr(4);
  const std::size_t colon = kinds.find(':');
  const bool has_one_kind = colon == std::string::npos;
  const bool has_two_kinds = !has_one_kind && kinds.find(':', colon + 1) == std::string::npos;
  if (form == "phi:" && has_one_kind) {
    function.form_ = Form::kPhi;
    function.phi_kind_ = kinds;
  } else if (form == "rho:" && has_one_kind) {
    function.form_ = Form::kRho;
    function.rho_kind_ = kinds;
  } else if (form == "set:" && has_two_kinds) {
    function.form_ = Form::kSet;
    function.phi_kind_ = kinds.substr(0, colon);
    function.rho_kind_ = kinds.substr(colon + 1);
  } else {
    return std::nullopt;
  }
  return function;
}

FunctionId::FunctionId(const std::string& name) {
  std::optional<FunctionId> function = parse(name);
  if (!function) throw std::invalid_argument("no function is called \"" + name + "\"");
  *this = *std::move(function);
}

std::vector<FunctionId> FunctionId::parts() const {
  if (is_set()) return {input_part(), output_part()};
  return {*this};
}

std::ostream& operator<<(std::ostream& out, const FunctionId& function) { return out << function.name(); }

}  // namespace swarmcert::files
