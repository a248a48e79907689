// %% [markdown]
// # 11 Where can this loop go? Two public benchmarks
//
// Which states can a nonlinear closed loop reach from a set of initial states? The reachability competition ARCH-COMP
// asks this of one quadrotor with 12 states, under a PD law and under a network.
//
//     x = c + sum_k a_k e_k + r,   |e_k| <= 1, |r| <= radius      an affine form: a set that knows what it depends on
//     x(t) = sum_(k < K) c_k t^k + c_K t^K,   c_K over a box that is proved to contain all solutions
//
// Every operation rounds outwards, so the statements below hold in exact arithmetic, for the decimal numbers of the
// benchmark.
//
// ## A step in altitude (nonlinear category, QUAD)
//
// F = m g - 10 (x3 - 1) + 3 x6; |x1| .. |x6| <= D at first. To show: x3 <= 1.4, x3 >= 0.9 from 1 s on, and x3 in
// [0.98, 1.02] at 5 s. Known, because the attitude stays 0 and leaves a linear equation:
//
// | D | max x3 | min x3 from 1 s | x3 at 5 s | property |
// |---|---|---|---|---|
// | 0.1 | 1.278358 | .929602 | [.995746, .996631] | true |
// | 0.4 | 1.356206 | .909914 | [.994418, .997958] | true |
// | 0.8 | 1.462088 | .883136 | [.992648, .999728] | false |
//
// Nothing of this is assumed here: all 12 equations are enclosed, and the forms of attitude and rates come out as
// exactly 0.

// %%
#include <fmt/format.h>

#include <cmath>

#include "notebooks_cpp/notebook.h"
#include "stability/reach/arch_quadrotor.h"

using namespace swarmcert;
using namespace swarmcert::stability;

constexpr std::size_t kAltitude = 2;  // x3
const Interval kStep_s = decimal(0.1);

std::vector<FlowStep> altitude_steps(const AffineVector& start) {
  return reach([](const AffineVector&) { return VectorField(arch_altitude_step); }, start, kStep_s, 50, 12);
}

/// With seven digits, rounded outwards.
std::string rounded(Interval x) {
  return fmt::format("[{:.7f}, {:.7f}]", std::floor(x.lower * 1e7) / 1e7, std::ceil(x.upper * 1e7) / 1e7);
}

AffineForm altitude_at_5_s(const std::vector<FlowStep>& steps) {
  return steps.back().x[kAltitude].at(kStep_s);
}

int main() {
  std::vector<FlowStep> steps;
  Extreme highest;
  std::string data;
  for (const double D : {0.1, 0.4, 0.8}) {
    steps = altitude_steps(arch_start({D, D, D, D, D, D}));
    highest = extreme(steps, 0, kAltitude, Side::kLargest, 400, 6);
    const Extreme lowest = extreme(steps, 10, kAltitude, Side::kSmallest, 400, 6);
    const Interval last = altitude_at_5_s(steps).range();
    const bool holds =
        highest.value.upper <= 1.4 && lowest.value.lower >= 0.9 && last.lower >= 0.98 && last.upper <= 1.02;
    bool is_level = true;
    for (std::size_t k = 6; k < 12; ++k) is_level = is_level && steps.back().at(kStep_s)[k].is_zero();
    fmt::print("D = {}, attitude {}: {}\n", D, is_level ? "0" : "not 0", holds ? "proved" : "not proved");
    fmt::print("  max x3 in {}, min from 1 s in {}, at 5 s in {}\n", rounded(highest.value),
               rounded(lowest.value), rounded(last));
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const Interval x3 = steps[k].x[kAltitude].at(0.0).range();
      data += fmt::format("{:.1f} {:.4f} {:.4f}\n", 0.1 * static_cast<double>(k), x3.lower, x3.upper);
    }
    data += "\n\n";
  }

  // %% [markdown]
  // For D = 0.8 the property is false. The form of x3 where it is largest names the initial state: the corner at which
  // each symbol has the sign of its slope. The solution from this point is enclosed again, by itself.

  // %%
  const AffineForm form = steps[highest.step].x[kAltitude].at(highest.time_s);
  AffineVector corner(12);
  for (std::size_t k = 0; k < 6; ++k) corner[k] = decimal(form.slopes[k] < 0 ? -0.8 : 0.8);
  const Interval altitude = altitude_steps(corner)[highest.step].x[kAltitude].at(highest.time_s).range();
  fmt::print("from (");
  for (std::size_t k = 0; k < 6; ++k) fmt::print("{}{}", k > 0 ? ", " : "", corner[k].centre);
  fmt::print(", 0, 0, 0, 0, 0, 0): x3 in {} at {:.4f} s; refuted: {}\n", rounded(altitude),
             0.1 * static_cast<double>(highest.step) + highest.time_s, altitude.lower > 1.4);
  notebook::plot("altitude_step", data,
                 "set xlabel 'time (s)'\nset ylabel 'altitude x3 (m)'\nset grid\nset key bottom\n"
                 "set style fill transparent solid 0.35\n"
                 "plot 'altitude_step.dat' index 2 using 1:2:3 with filledcurves linecolor rgb '#d55e00' "
                 "title 'D = 0.8', "
                 "'' index 1 using 1:2:3 with filledcurves linecolor rgb '#009e73' title 'D = 0.4', "
                 "'' index 0 using 1:2:3 with filledcurves linecolor rgb '#0072b2' title 'D = 0.1', "
                 "1.4 with lines linecolor rgb '#000000' title 'limit', "
                 "(x > 1 ? 0.9 : NaN) with lines linecolor rgb '#000000' notitle\n");

  // %% [markdown]
  // ## A network as controller (category AINNCS, QUAD)
  //
  // F = m g + u1, roll torque u2, pitch torque u3, from a network of 12-64-64-64-3 with sigmoids that is evaluated ten
  // times a second. To show: x3 in [0.94, 1.06] at 5 s. Initial states: |x1| .. |x6| <= 0.4; JuliaReach proves 1 % of
  // this radius. A neuron's form is its tangent, so the outputs remember the initial state. 1 % and 10 % of the radius
  // are one set; the whole box is cut into ten parts along x3.

  // %%
  const auto verdict = [](Interval x3) {
    return x3.lower >= 0.94 && x3.upper <= 1.06 ? "proved" : "not proved";
  };
  const SampledField loop =
      arch_network_loop(files::load_weights("data/weights/arch/QUAD_quad_controller_3_64_torch.onnx"));
  for (const double r : {0.004, 0.04}) {
    const Interval x3 = altitude_at_5_s(reach(loop, arch_start({r, r, r, r, r, r}), kStep_s, 50, 4)).range();
    fmt::print("radius {}: x3 in {} at 5 s: {}\n", r, rounded(x3), verdict(x3));
  }
  Interval all{kInfinity, -kInfinity};
  for (int part = 0; part < 10; ++part) {
    const Interval middle = Interval(part) * decimal(0.08) - decimal(0.36);
    const AffineVector start = arch_start({0.4, 0.4, 0.04, 0.4, 0.4, 0.4}, middle);
    all = hull(all, altitude_at_5_s(reach(loop, start, kStep_s, 50, 4)).range());
  }
  fmt::print("radius 0.4: x3 in {} at 5 s: {}\n", rounded(all), verdict(all));

  // %% [markdown]
  // Processor time on one core, optimised build:
  //
  // | | seconds |
  // |---|---|
  // | one D, with both extremes over time | 0.2 |
  // | network, radius 0.004 or 0.04 | 0.3 |
  // | network, radius 0.4 in ten parts | 3.0 |

  // %%
}
