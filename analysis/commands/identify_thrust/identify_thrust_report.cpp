#include "analysis/commands/identify_thrust/identify_thrust_report.h"

#include <fmt/core.h>

#include <cmath>

#include "analysis/cli/command_line.h"
#include "analysis/report/report.h"

namespace swarmcert::analysis {
namespace {

/// Additional points would not be visible.
constexpr std::size_t kMostPoints = 2000;

/// c00 + c10 p + c01 v + c20 p^2 + c11 p v, in gf; NaN if the fit is not determined.
double fitted_gf(const PolynomialFit& fit, double p, double v) {
  if (!fit.determined) return std::nan("");
  double sum = 0;
  for (const Coefficient& c : fit.coefficients) {
    const double of_p = c.name == "c10" || c.name == "c11" ? p : c.name == "c20" ? p * p : 1;
    const double of_v = c.name == "c01" || c.name == "c11" ? v : 1;
    sum += c.value * of_p * of_v;
  }
  return sum;
}

void add_polynomial(Report& report, const std::string& title, const PolynomialFit& fit) {
  report.heading(title);
  if (!fit.determined) {
    report.paragraph("Not determined: " + fit.why_not);
    return;
  }
  report.paragraph(fmt::format("{}; {} samples, residual RMS {:.4g} {}, largest {:.4g}.", fit.method,
                               fit.samples, fit.residual_rms, fit.unit, fit.largest_residual));
  if (fit.lack.is_found())
    report.paragraph(fmt::format("Lack of fit: {:.3g} {} RMS, which {} show (F test, chance {:.2g}).",
                                 fit.lack.rms, fit.unit, fit.lack.against, fit.lack.chance));
  std::vector<std::vector<std::string>> rows;
  for (const Coefficient& c : fit.coefficients) {
    rows.push_back({c.name, fmt::format("{:.10g}", c.value), fmt::format("{:.6g}", c.lower),
                    fmt::format("{:.6g}", c.upper)});
  }
  report.table({"coefficient", "value", "at least", "at most"}, rows);
}

}  // namespace

std::string write_thrust_report(const ThrustData& data, const ThrustIdentification& found,
                                const files::Node& result, const std::string& folder, bool overwrite) {
  Report report("Thrust calibration");
  report.made_by(command_to_copy());
  report.result(result);
  report.paragraph(fmt::format("{}: {} rows; intervals of {:.6g} %. p = PWM / 65536, v = V / 4.2.", data.path,
                               data.samples.size(), 100 * found.confidence));
  std::string points = "# p measured_gf fitted_gf residual_gf\n";
  const std::size_t stride = data.samples.size() / kMostPoints + 1;
  for (std::size_t i = 0; i < data.samples.size(); i += stride) {
    const ThrustSample& s = data.samples[i];
    const double fitted = fitted_gf(found.thrust, s.p, s.v);
    points += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", s.p, s.thrust_gf, fitted, s.thrust_gf - fitted);
  }
  const std::string fit_curve =
      found.thrust.determined ? ", '' using 1:3 with dots linetype 2 linewidth 3 title 'polynomial'" : "";
  report.figure(
      "thrust", points,
      "set xlabel 'p = PWM / 65536 [-]'\nset ylabel 'thrust of one rotor [gf]'\n"
      "plot 'thrust.dat' using 1:2 with points linetype 1 pointsize 0.4 title 'measured'" +
          fit_curve + "\n",
      "Measured thrust of one rotor over PWM, and the polynomial at the same PWM and battery voltage.");
  if (found.thrust.determined) {
    report.figure(
        "residual", points,
        "set xlabel 'p = PWM / 65536 [-]'\nset ylabel 'measured minus polynomial [gf]'\nset key off\n"
        "plot 'residual.dat' using 1:4 with points linetype 1 pointsize 0.4, 0 linecolor rgb 'black'\n",
        "Residual of the polynomial: a pattern indicates physics that it lacks.");
  }
  add_polynomial(report, "Thrust from PWM and voltage", found.thrust);
  add_polynomial(report, "PWM from thrust and voltage", found.pwm);
  add_polynomial(report, "Largest thrust", found.max_thrust);
  add_polynomial(report, "Thrust in N from the voltage of the motor, a cubic", found.motor_voltage);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
