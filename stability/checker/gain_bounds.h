/// @file Upper bounds of the gains of one continuous loop, verified from a witness. Trusts no search.
#pragma once

#include <gmpxx.h>

#include <optional>
#include <string>
#include <vector>

namespace swarmcert::check {

/// One axis. All numbers count exactly as they stand.
struct LoopNumbers {
  double mass_kg = 0;
  double Kp = 0;  ///< 1/s^2
  double Kd = 0;  ///< 1/s
  double Ki = 0;  ///< 1/s^3, as the law states it
  std::vector<double> lags_s;
  double delay_s = 0;  ///< of the command, before the lags
};

/// A continuous loop with one input, and what shows that its response decays.
struct LoopWitness : LoopNumbers {
  std::string input;    ///< force, command, velocity or position
  int delay_order = 0;  ///< of the delay's expansion, at most the number of lags

  int time_exponent = 0;  ///< time is counted in 2^-time_exponent s
  int step_exponent = 0;  ///< a cell is 2^-step_exponent such units long
  long steps = 0;         ///< cells that are followed; the rest is the tail
  double decay = 0;       ///< per unit of time: |x(t)|_P <= e^(-decay t) |x(0)|_P
  std::vector<std::vector<double>> P;
};

/// Upper bounds, per unit of the input; see kTrackingStatement.
struct GainBounds {
  std::optional<mpq_class> rate;  ///< nothing where a constant input leaves an error
  mpq_class amplitude, edge, impulse;
};

/// Order of the characteristic polynomial, the size of P.
std::size_t order(const LoopWitness& loop);

/// x = (y, y', ...) / powers of the time unit, y the response to an impulse; x' = A x, A the companion matrix, exact.
/// P > 0 and A'P + PA + 2 decay P < 0 are verified by exact elimination. The state goes from cell to cell by the Taylor
/// sum of exp(A cell) to order 24 in integers over 2^128; what that misses never grows, in the norm of P, and is added
/// up. Within a cell |f| <= the line through |f| at both ends + cell^2/8 sup|f''|. After the last cell, |r x| <=
/// sqrt(r P^-1 r') |x|_P, which decays.
/// A delay T is expanded: A is that of D0 = open + feedback R, R the Taylor polynomial of e^(-Ts) of degree k =
/// delay_order. What is left, (-s)^(k+1) times a kernel of one sign and of integral T^(k+1)/(k+1)!, takes at most
/// lambda = T^(k+1)/(k+1)! |s^(k+1) feedback/D0|_1 of a response (a jump at 0 counts), so that lambda < 1 must hold and
/// all bounds are divided by 1 - lambda.
/// @throws std::runtime_error with the reason where the witness shows nothing, or a number is out of range.
GainBounds upper_gains(const LoopWitness& loop);

}  // namespace swarmcert::check
