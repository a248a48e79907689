#include "analysis/identification/scan/forms.h"

#include <cmath>
#include <utility>

namespace swarmcert::identification {

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

namespace {

constexpr double kTwoPi = 6.283185307179586;

std::vector<double> along(const FormRange& range, int count) {
  std::vector<double> places;
  for (int k = 0; k < count; ++k) places.push_back(range.lower + range.span() * (k + 0.5) / count);
  return places;
}

FormParameter place(const std::string& name, const FormRange& range, int count = 8) {
  return {name, FormUnit::kVariable, range.lower - 0.5 * range.span(), range.upper + 0.5 * range.span(),
          along(range, count)};
}

FormParameter width(const std::string& name, double span, std::vector<double> shares) {
  for (double& share : shares) share *= span;
  return {name, FormUnit::kVariable, 0.01 * span, 3 * span, shares};
}

double square(double x) { return x * x; }

Form decay(const FormRange& range, bool upwards) {
  const double from = upwards ? range.lower : range.upper;
  // The reference position, at which the force equals its coefficient, only scales the coefficient.
  FormParameter reference = {"from", FormUnit::kVariable, from, from, {from}};
  Form form;
  form.name = upwards ? "decay" : "growth";
  form.shape = {width("length", range.span(), {0.05, 0.1, 0.2, 0.4, 0.8}), reference};
  const double sign = upwards ? -1 : 1;
  form.values = [sign](const double* v, const double* t, double* to) {
    to[0] = std::exp(std::fmin(sign * (v[0] - t[1]) / t[0], 20.0));
  };
  form.texts = {upwards ? "exp(min(-({0} - {b}) / {a}, 20))" : "exp(min(({0} - {b}) / {a}, 20))"};
  return form;
}

Form hinge(const FormRange& range, bool above) {
  Form form;
  form.name = above ? "above" : "below";
  form.shape = {place("from", range, 12)};
  form.values = [above](const double* v, const double* t, double* to) {
    to[0] = std::fmax(0.0, above ? v[0] - t[0] : t[0] - v[0]);
  };
  form.texts = {above ? "max(0, {0} - {a})" : "max(0, {a} - {0})"};
  return form;
}

Form gaussian(const FormRange& range, int centres, std::vector<double> widths) {
  return {"gaussian",
          1,
          {place("centre", range, centres), width("width", range.span(), std::move(widths))},
          [](const double* v, const double* t, double* to) {
            to[0] = std::exp(-square((v[0] - t[0]) / t[1]) / 2);
          },
          {"exp(-(({0} - {a}) / {b})^2 / 2)"}};
}

Form step(const FormRange& range, int places, bool above) {
  return {above ? "step" : "step_down",
          1,
          {place("at", range, places)},
          [above](const double* v, const double* t, double* to) {
            to[0] = (above ? v[0] > t[0] : v[0] < t[0]) ? 1 : 0;
          },
          {above ? "({0} > {a})" : "({0} < {a})"}};
}

/// Returns the product of a form over the first and a form over the second variable, each with one function.
Form product(const Form& first, const Form& second) {
  Form form;
  form.name = first.name + "_" + second.name;
  form.inputs = 2;
  form.is_product = true;
  for (FormParameter parameter : first.shape) {
    parameter.name = "x_" + parameter.name;
    form.shape.push_back(std::move(parameter));
  }
  for (FormParameter parameter : second.shape) {
    parameter.name = "y_" + parameter.name;
    form.shape.push_back(std::move(parameter));
  }
  form.values = [f = first.values, g = second.values, n = first.shape.size()](const double* v,
                                                                              const double* t, double* to) {
    double value = 0;
    f(v, t, &value);
    g(v + 1, t + n, to);
    to[0] *= value;
  };
  std::string text = second.texts[0];
  for (std::size_t k = second.shape.size(); k-- > 0;)
    replace_all(text, kShapeLetters[k], kShapeLetters[k + first.shape.size()]);
  replace_all(text, "{0}", "{1}");
  form.texts = {first.texts[0] + " * " + text};
  return form;
}

/// Adds edges along either variable, and strips along one variable that end at an edge along the other.
void add_edges(const FormRange& x, const FormRange& y, std::vector<Form>& forms) {
  const Form across_x = gaussian(x, 7, {0.1, 0.3}), across_y = gaussian(y, 7, {0.1, 0.3});
  for (const bool above_x : {true, false}) {
    for (const bool above_y : {true, false})
      forms.push_back(product(step(x, 20, above_x), step(y, 20, above_y)));
    forms.push_back(product(step(x, 20, above_x), across_y));
    forms.push_back(product(across_x, step(y, 20, above_x)));
  }
}

/// Sets the units of the coefficients: newton over the variable's unit to these powers.
std::vector<Form> with_powers(std::vector<Form> forms) {
  for (Form& form : forms) {
    const std::string& name = form.name;
    for (const char* const first : {"linear", "absolute", "above", "below", "beyond"}) {
      if (name == first) form.powers[0] = 1;
    }
    if (name == "signed_square") form.powers[0] = 2;
    if (name == "plane") form.powers[0] = form.powers[1] = 1;
    if (name == "quadratic") {
      form.powers[0] = 1;
      form.powers[1] = 2;
    }
  }
  return forms;
}

void add_polynomials(bool has_origin, std::vector<Form>& forms) {
  forms.push_back(
      {"linear", 1, {}, [](const double* v, const double*, double* to) { to[0] = v[0]; }, {"{0}"}});
  forms.push_back({"quadratic",
                   1,
                   {},
                   [](const double* v, const double*, double* to) {
                     to[0] = v[0];
                     to[1] = v[0] * v[0];
                   },
                   {"{0}", "{0}^2"}});
  if (!has_origin) return;
  forms.push_back({"signed_square",
                   1,
                   {},
                   [](const double* v, const double*, double* to) { to[0] = v[0] * std::abs(v[0]); },
                   {"{0} * abs({0})"}});
  forms.push_back({"absolute",
                   1,
                   {},
                   [](const double* v, const double*, double* to) { to[0] = std::abs(v[0]); },
                   {"abs({0})"}});
}

Form sinusoid(double span) {
  FormParameter wave = {"wave_number", FormUnit::kInverse, 0.2 * kTwoPi / span, 30 * kTwoPi / span, {}};
  for (int k = 2; k <= 40; ++k) wave.starts.push_back(0.25 * k * kTwoPi / span);
  return {"sinusoid",
          1,
          {wave},
          [](const double* v, const double* t, double* to) {
            to[0] = std::sin(t[0] * v[0]);
            to[1] = std::cos(t[0] * v[0]);
          },
          {"sin({a} * {0})", "cos({a} * {0})"}};
}

Form resonance(const FormRange& range) {
  return {"resonance",
          1,
          {place("at", {range.lower + 0.1 * range.span(), range.upper}, 12),
           {"damping", FormUnit::kNone, 0.02, 1, {0.05, 0.1, 0.2, 0.4}}},
          [](const double* v, const double* t, double* to) {
            const double u = v[0] / t[0];
            to[0] = 1 / std::sqrt(square(1 - u * u) + square(2 * t[1] * u));
          },
          {"1 / sqrt((1 - ({0} / {a})^2)^2 + (2 * {b} * {0} / {a})^2)"}};
}

}  // namespace

std::vector<Form> forms_over(const FormRange& range, bool has_origin) {
  const double span = range.span();
  std::vector<Form> forms;
  add_polynomials(has_origin, forms);
  forms.push_back(decay(range, true));
  forms.push_back(decay(range, false));
  forms.push_back(gaussian(range, 10, {0.05, 0.1, 0.2, 0.4}));
  forms.push_back(step(range, 60, true));
  forms.push_back({"logistic",
                   1,
                   {place("middle", range, 10), width("width", span, {0.02, 0.05, 0.1, 0.2})},
                   [](const double* v, const double* t, double* to) {
                     to[0] = 1 / (1 + std::exp(std::fmin(-(v[0] - t[0]) / t[1], 50.0)));
                   },
                   {"1 / (1 + exp(min(-({0} - {a}) / {b}, 50)))"}});
  forms.push_back(hinge(range, true));
  forms.push_back(hinge(range, false));
  forms.push_back({"inverse_square",
                   1,
                   {place("centre", range, 10), width("core", span, {0.05, 0.1, 0.2})},
                   [](const double* v, const double* t, double* to) {
                     to[0] = t[1] * t[1] / (square(v[0] - t[0]) + t[1] * t[1]);
                   },
                   {"{b}^2 / (({0} - {a})^2 + {b}^2)"}});
  if (range.lower >= 0) forms.push_back(resonance(range));
  forms.push_back(sinusoid(span));
  return with_powers(std::move(forms));
}

std::vector<Form> forms_over_place(const FormRange& x, const FormRange& y) {
  const double span = std::fmax(x.span(), y.span());
  const auto distance2 = [](const double* v, const double* t) {
    return square(v[0] - t[0]) + square(v[1] - t[1]);
  };
  const std::string text = "(({0} - {a})^2 + ({1} - {b})^2)";
  std::vector<Form> forms;
  forms.push_back({"plane",
                   2,
                   {},
                   [](const double* v, const double*, double* to) {
                     to[0] = v[0];
                     to[1] = v[1];
                   },
                   {"{0}", "{1}"}});
  const FormParameter cx = place("x_centre", x, 7), cy = place("y_centre", y, 7);
  forms.push_back({"gaussian",
                   2,
                   {cx, cy, width("width", span, {0.08, 0.15, 0.3})},
                   [=](const double* v, const double* t, double* to) {
                     to[0] = std::exp(-distance2(v, t) / (2 * t[2] * t[2]));
                   },
                   {"exp(-" + text + " / (2 * {c}^2))"}});
  forms.push_back({"inverse_square",
                   2,
                   {cx, cy, width("core", span, {0.05, 0.1, 0.2})},
                   [=](const double* v, const double* t, double* to) {
                     to[0] = t[2] * t[2] / (distance2(v, t) + t[2] * t[2]);
                   },
                   {"{c}^2 / (" + text + " + {c}^2)"}});
  forms.push_back({"beyond",
                   2,
                   {cx, cy, width("radius", span, {0.1, 0.2, 0.3, 0.5})},
                   [=](const double* v, const double* t, double* to) {
                     to[0] = std::fmax(0.0, std::sqrt(distance2(v, t)) - t[2]);
                   },
                   {"max(0, sqrt(" + text + ") - {c})"}});
  add_edges(x, y, forms);
  return with_powers(std::move(forms));
}

std::vector<Form> forms_over_section(const FormRange& along, const FormRange& height) {
  std::vector<Form> forms = forms_over_place(along, height);
  for (const bool upwards : {true, false}) {
    const Form with_height = decay(height, upwards);
    forms.push_back(product(step(along, 20, true), with_height));
    forms.push_back(product(step(along, 20, false), with_height));
    forms.push_back(product(gaussian(along, 7, {0.1, 0.3}), with_height));
  }
  return forms;
}

}  // namespace swarmcert::identification
