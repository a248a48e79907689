#include "analysis/commands/certify/certify_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/cli/command_line.h"
#include "analysis/report/report.h"
#include "analysis/report/report_text.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

using lipschitz::CertifiedBound;
using lipschitz::CertifiedLayer;

double slope_of(const lipschitz::FoundSlope& found) {
  return found.witness ? found.witness->slope.value() : std::numeric_limits<double>::quiet_NaN();
}

std::string number(double x, int digits) {
  return std::isfinite(x) ? fmt::format("{:.{}g}", x, digits) : "-";
}

void add_bounds(Report& report, const files::Network& network, const CertifyOutput& output) {
  report.heading("Lipschitz constants");
  std::vector<std::vector<std::string>> rows;
  std::string data = "# function product proved witnessed\n";
  for (const CertifiedBound& bound : output.found.bounds) {
    const double lower = slope_of(bound.lower);
    rows.push_back({label(bound), bound.domain, number(bound.upper.value(), 10), name(bound.method),
                    number(bound.product.value(), 8), number(lower, 8),
                    files::unit(network, bound.function, bound.block)});
    // A logarithmic axis cannot show zero.
    data += fmt::format("{} {:.17g} {:.17g} {}\n", plot_field(label(bound)), bound.product.value(),
                        bound.upper.value(), lower > 0 ? fmt::format("{:.17g}", lower) : "NaN");
  }
  report.table(
      {"function", "domain", "proved upper", "method", "product of norms", "witnessed lower", "unit"}, rows);
  report.figure(
      "bounds", data,
      "set style data histograms\nset style fill solid 0.9 noborder\nset logscale y\n"
      "set ylabel 'Lipschitz constant [unit: see table]'\nset xtics rotate by -30\nset boxwidth 0.9\n"
      "plot 'bounds.dat' using 2:xtic(1) title 'product of norms' linecolor rgb '#999999', "
      "'' using 3 title 'proved upper (joint)' linetype 1, "
      "'' using 4 title 'witnessed lower' linetype 5\n",
      "Product of spectral norms, proved joint bound and witnessed slope of each function: the true "
      "constant lies between the last two. Logarithmic scale.");
}

/// Formats an enclosure with eight digits, rounded outward.
std::pair<std::string, std::string> outwards(double lower, double upper) {
  const double unit = std::pow(10, std::floor(std::log10(std::max(upper, 1e-300))) - 7);
  constexpr double kSlack = 1e-15;  // for the rounding of the divisions here
  return {number(std::floor(lower / unit * (1 - kSlack)) * unit, 8),
          number(std::ceil(upper / unit * (1 + kSlack)) * unit, 8)};
}

void add_layers(Report& report, const CertifyOutput& output) {
  report.heading("Spectral norms of the layers");
  std::vector<std::vector<std::string>> rows;
  std::vector<Bar> bars;
  for (const CertifiedLayer& layer : output.found.layers) {
    const double lower = layer.norm.norm.lower.value(), upper = layer.norm.norm.upper.value();
    const auto [at_least, at_most] = outwards(lower, upper);
    rows.push_back({layer.network.name(), layer.name, at_least, at_most,
                    layer.respects_gamma ? name(*layer.respects_gamma) : "not stated"});
    bars.push_back({layer.network.name() + " " + layer.name, upper, lower, upper});
  }
  report.bars("layers", bars, "spectral norm [output per input of the layer]",
              output.found.gamma
                  ? fmt::format("Spectral norms of the layers, at most {:.6g} if gamma holds in each layer.",
                                output.found.gamma->value)
                  : std::string("Spectral norms of the layers."));
  report.table({"network", "layer", "at least", "at most", "within gamma"}, rows);
}

}  // namespace

std::string write_certify_report(const files::Network& network, const CertifyOutput& output,
                                 const files::Node& result, const std::string& folder, bool overwrite) {
  Report report("Lipschitz certificate");
  report.made_by(command_to_copy());
  report.result(result);
  report.paragraph(fmt::format(
      "Verdict: {}. Every upper bound is proved in exact arithmetic for the weights as stored, in "
      "Euclidean norms, over all inputs or over the box where the table says so; every witnessed "
      "value is the slope between two float32 points.",
      name(output.verdict)));
  add_bounds(report, network, output);
  add_layers(report, output);
  report.heading("Inputs");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [part, weights] : files::parts(network))
    rows.push_back({part.name(), weights->path, weights->sha256});
  report.table({"network", "file", "sha256"}, rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
