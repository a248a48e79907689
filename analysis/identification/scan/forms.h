/// @file Physical forms of a force over one variable or over a position.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace swarmcert::identification {

/// Range of the values, for starts and bounds of parameters.
struct FormRange {
  double lower = 0, upper = 1;
  double span() const { return upper - lower; }
};

/// Unit of a parameter of a form.
enum class FormUnit { kVariable, kInverse, kNone };  ///< the variable's unit, its inverse, or none

struct FormParameter {
  std::string name;  ///< "width"; the unit is appended
  FormUnit unit = FormUnit::kVariable;
  double lower = 0, upper = 0;
  std::vector<double> starts;
};

/// Functions g_1(v; theta), ..., g_m(v; theta) of a force sum a_k g_k + c.
struct Form {
  std::string name;  ///< "gaussian"
  int inputs = 1;    ///< 1, or 2 for positions
  std::vector<FormParameter> shape;
  /// Evaluates the m functions.
  /// @param v [inputs], theta [shape.size()], to [m]
  std::function<void(const double* v, const double* theta, double* to)> values;
  /// The functions as text, with {0}, {1} for variables and kShapeLetters for shape parameters in their order.
  std::vector<std::string> texts;
  int powers[2] = {0, 0};  ///< of the variable in each function; determines the units of the coefficients
  bool has_offset = true;
  bool is_product = false;  ///< product of forms of one variable each
};

inline constexpr int kMostFormFunctions = 2;
inline constexpr const char* kShapeLetters[] = {"{a}", "{b}", "{c}", "{d}"};

/// Replaces each `from` in `text` by `to`.
void replace_all(std::string& text, const std::string& from, const std::string& to);

/// Returns all forms of one variable.
/// @param range of its values; `has_origin`: zero is physically meaningful, as for velocities
std::vector<Form> forms_over(const FormRange& range, bool has_origin);
/// Returns all forms over a position in the plane. The parameters of each variable begin with x_ or y_.
std::vector<Form> forms_over_place(const FormRange& x, const FormRange& y);
/// Returns all forms over a position in a vertical section, whose second variable is also called y.
std::vector<Form> forms_over_section(const FormRange& along, const FormRange& height);

}  // namespace swarmcert::identification
