/// @file Physical forms that a force may have over one variable, or over a place.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace swarmcert::identification {

/// Where values lie: for starts and bounds of parameters.
struct FormRange {
  double lower = 0, upper = 1;
  double span() const { return upper - lower; }
};

/// What a parameter of a form is measured in.
enum class FormUnit { kVariable, kInverse, kNone };  ///< the variable's unit, one over it, or a pure number

struct FormParameter {
  std::string name;  ///< "width"; the unit is appended
  FormUnit unit = FormUnit::kVariable;
  double lower = 0, upper = 0;
  std::vector<double> starts;
};

/// g_1(v; theta), ..., g_m(v; theta): a force is sum a_k g_k + c.
struct Form {
  std::string name;  ///< "gaussian"
  int inputs = 1;    ///< 1, or 2 for places
  std::vector<FormParameter> shape;
  /// Values of the m functions. @param v [inputs], theta [shape.size()], to [m]
  std::function<void(const double* v, const double* theta, double* to)> values;
  /// The functions as text, with {0}, {1} for variables and kShapeLetters for shape parameters in their order.
  std::vector<std::string> texts;
  int powers[2] = {0, 0};  ///< of the variable in each function: units of the coefficients
  bool has_offset = true;
  bool is_product = false;  ///< of forms of one variable each
};

inline constexpr int kMostFormFunctions = 2;
inline constexpr const char* kShapeLetters[] = {"{a}", "{b}", "{c}", "{d}"};

/// Puts `to` wherever `from` stands.
void replace_all(std::string& text, const std::string& from, const std::string& to);

/// All forms of one variable. @param range of its values; `has_origin` where zero is a physical one, as of velocities.
std::vector<Form> forms_over(const FormRange& range, bool has_origin);
/// All forms over a place in the plane. Parameters of one variable begin with x_ or y_.
std::vector<Form> forms_over_place(const FormRange& x, const FormRange& y);
/// All forms over a place in a vertical section, whose second variable is called y here too.
std::vector<Form> forms_over_section(const FormRange& along, const FormRange& height);

}  // namespace swarmcert::identification
