#include "analysis/commands/diagnose/each_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <optional>

#include "analysis/commands/shared/effect_output.h"
#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
namespace {

using identification::Drift;
using identification::Each;
using identification::EachDay;
using identification::EachFlight;
using identification::FlightNumber;
using identification::FlightNumbers;

void describe_numbers(files::Record& record, const FlightNumbers& numbers) {
  for (const std::string& name : identification::each_numbers()) {
    const auto number = numbers.find(name);
    std::optional<FittedValue> shown;
    if (number != numbers.end() && number->second.is_observable)
      shown = FittedValue{number->second.value, number->second.interval};
    record.field(name.c_str(), shown, "A factor where 1 is nominal; null: not shown.");
  }
}

std::vector<std::string> outliers_of(const EachFlight& flight) {
  std::vector<std::string> names;
  for (const std::string& name : identification::each_numbers()) {
    const auto number = flight.numbers.find(name);
    if (number != flight.numbers.end() && number->second.is_outlier) names.push_back(name);
  }
  return names;
}

std::string cell(const FlightNumbers& numbers, const std::string& name) {
  const auto number = numbers.find(name);
  if (number == numbers.end() || !number->second.is_observable) return "-";
  const FlightNumber& n = number->second;
  return fmt::format("{:.4g} ({:.4g} .. {:.4g}){}", n.value, n.interval.lower, n.interval.upper,
                     n.is_outlier ? " outlier" : "");
}

/// Parameters that at least one flight reveals; logs without duties reveal no rotor.
std::vector<std::string> shown_numbers(const Each& each) {
  std::vector<std::string> shown;
  for (const std::string& name : identification::each_numbers()) {
    const bool is_shown =
        std::any_of(each.flights.begin(), each.flights.end(),
                    [&](const EachFlight& flight) { return cell(flight.numbers, name) != "-"; });
    if (is_shown || name.rfind("rotor_", 0) != 0) shown.push_back(name);
  }
  return shown;
}

void print_row(const std::string& name, const std::string& vehicle, const FlightNumbers& numbers,
               const std::vector<std::string>& shown) {
  fmt::print("    {:<28} {:<8}", name, vehicle);
  for (const std::string& number : shown) fmt::print(" {:<32}", cell(numbers, number));
  fmt::print("\n");
}

std::string words(const Drift& drift) {
  return fmt::format("{} of {} {}: {:.3g} per flight (90 %: {:.3g} .. {:.3g}) over {} flights", drift.number,
                     drift.vehicle, drift.is_there ? "drifts" : "does not drift visibly", drift.per_flight,
                     drift.interval.lower, drift.interval.upper, drift.flights);
}

/// Plots parameter `number` over the flights, one curve per vehicle. Returns false if no flight reveals it.
bool add_plot(Report& report, const Each& each, const std::string& number, const std::string& name) {
  std::map<std::string, std::string> curves;
  int place = 0;
  for (const EachFlight& flight : each.flights) {
    ++place;
    const auto found = flight.numbers.find(number);
    if (found == flight.numbers.end() || !found->second.is_observable) continue;
    const FlightNumber& n = found->second;
    curves[flight.vehicle] +=
        fmt::format("{} {:.6g} {:.6g} {:.6g} {} {}\n", place, n.value, n.interval.lower, n.interval.upper,
                    plot_field(flight.flight), plot_field(flight.vehicle));
  }
  if (curves.empty()) return false;
  std::string data = "# flight value lower upper name vehicle\n";
  for (const auto& [vehicle, rows] : curves) data += rows + "\n\n";
  report.figure(
      name, data,
      fmt::format(
          "set ylabel '{0}'\nset xlabel 'flight'\nset xtics rotate by -60\nset offsets 0.5, 0.5, 0, 0\n"
          "plot for [i=0:{1}] '{2}.dat' index i using 1:2:3:4:xtic(5) with yerrorbars notitle\n",
          number, curves.size() - 1, name),
      "The number " + number +
          " of every flight that shows it, with 90 % intervals; one colour per vehicle, flights in order of "
          "their names.");
  return true;
}

}  // namespace

void describe_each(files::Record& record, const std::vector<Each>& kinds) {
  Each all;
  for (const Each& each : kinds) {
    all.flights.insert(all.flights.end(), each.flights.begin(), each.flights.end());
    all.days.insert(all.days.end(), each.days.begin(), each.days.end());
    all.drifts.insert(all.drifts.end(), each.drifts.begin(), each.drifts.end());
  }
  record.list(
      "each", all.flights, "One row per vehicle and flight.", [](files::Record& r, const EachFlight& flight) {
        r.field("flight", flight.flight, "");
        r.field("day", flight.day, "");
        r.field("vehicle", flight.vehicle, "");
        r.field("kind", flight.kind, "");
        r.field("blocks", flight.blocks, "Of 2 s.");
        r.field("too_poor", flight.too_poor, "Why there are no numbers; empty if there are.");
        describe_numbers(r, flight.numbers);
        r.field("outlier", outliers_of(flight), "Numbers that stand out among the vehicle's flights.");
      });
  record.list("each_days", all.days, "Means of days.", [](files::Record& r, const EachDay& day) {
    r.field("day", day.day, "");
    r.field("vehicle", day.vehicle, "");
    r.field("kind", day.kind, "");
    r.field("flights", day.flights, "");
    describe_numbers(r, day.numbers);
  });
  record.list("each_drifts", all.drifts, "Changes from one flight to the next.",
              [](files::Record& r, const Drift& drift) {
                r.field("number", drift.number, "");
                r.field("vehicle", drift.vehicle, "");
                r.field("kind", drift.kind, "");
                r.field("per_flight", drift.per_flight, "", "", "estimate");
                r.field("interval_90", drift.interval, "");
                r.field("flights", drift.flights, "");
                r.field("drifts", drift.is_there, "The 99 % interval excludes zero.");
              });
}

void print_each(const Each& each) {
  fmt::print("  Each flight (90 % intervals):\n    {:<28} {:<8}", "flight", "vehicle");
  const std::vector<std::string> shown = shown_numbers(each);
  for (const std::string& number : shown) fmt::print(" {:<32}", number);
  fmt::print("\n");
  for (const EachFlight& flight : each.flights) {
    if (flight.too_poor.empty())
      print_row(flight.flight, flight.vehicle, flight.numbers, shown);
    else
      fmt::print("    {:<28} {:<8} too short: {}\n", flight.flight, flight.vehicle, flight.too_poor);
  }
  for (const EachDay& day : each.days) {
    if (day.flights > 1) print_row("mean of " + day.day, day.vehicle, day.numbers, shown);
  }
  for (const Drift& drift : each.drifts) {
    if (drift.is_there) fmt::print("    {}\n", words(drift));
  }
}

void add_each(Report& report, const Each& each, std::size_t number) {
  std::vector<std::string> header = {"flight", "vehicle"};
  const std::vector<std::string> shown = shown_numbers(each);
  for (const std::string& name : shown) header.push_back(name + ", 90 %");
  std::vector<std::vector<std::string>> rows;
  const auto add_row = [&rows, &shown](const std::string& name, const std::string& vehicle,
                                       const FlightNumbers& numbers) {
    rows.push_back({name, vehicle});
    for (const std::string& n : shown) rows.back().push_back(cell(numbers, n));
  };
  for (const EachFlight& flight : each.flights) add_row(flight.flight, flight.vehicle, flight.numbers);
  for (const EachDay& day : each.days) {
    if (day.flights > 1) add_row("mean of " + day.day, day.vehicle, day.numbers);
  }
  report.paragraph("The same parameters for every flight; the effects common to all flights are held fixed:");
  report.table(header, rows);
  std::size_t plots = 0;
  for (const std::string& name : identification::each_numbers()) {
    if (add_plot(report, each, name, fmt::format("each_{}_{}", number, plots + 1))) ++plots;
  }
  for (const Drift& drift : each.drifts) report.paragraph(words(drift) + ".");
}

}  // namespace swarmcert::analysis
