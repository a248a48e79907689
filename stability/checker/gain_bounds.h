/// @file Upper bounds of the gains of one continuous loop, verified from a witness. No search is trusted.
#pragma once

#include <gmpxx.h>

#include <optional>
#include <string>
#include <vector>

namespace swarmcert::check {

/// One axis. All numbers are taken exactly as written.
struct LoopNumbers {
  double mass_kg = 0;
  double Kp = 0;  ///< 1/s^2
  double Kd = 0;  ///< 1/s
  double Ki = 0;  ///< 1/s^3, as the law states it
  std::vector<double> lags_s;
  double delay_s = 0;  ///< of the command, before the lags
};

/// A continuous loop with one input, and the witness that its response decays.
struct LoopWitness : LoopNumbers {
  std::string input;    ///< force, command, velocity or position
  int delay_order = 0;  ///< of the delay's Taylor expansion, at most the number of lags

  int time_exponent = 0;  ///< time is measured in units of 2^-time_exponent s
  int step_exponent = 0;  ///< a cell is 2^-step_exponent such units long
  long steps = 0;         ///< number of cells that are propagated; the rest is the tail
  double decay = 0;       ///< per unit of time: |x(t)|_P <= e^(-decay t) |x(0)|_P
  std::vector<std::vector<double>> P;
};

/// Upper bounds per unit of the input; see kTrackingStatement.
struct GainBounds {
  std::optional<mpq_class> rate;  ///< nothing if a constant input leaves a steady-state error
  mpq_class amplitude, edge, impulse;
};

/// Returns the order of the characteristic polynomial, which is the size of P.
std::size_t order(const LoopWitness& loop);

/// Let x = (y, y', ...) / powers of the time unit, y the response to an impulse; x' = A x, A the companion matrix,
/// exact. P > 0 and A'P + PA + 2 decay P < 0 are verified by exact elimination. The state is propagated from cell to
/// cell by the Taylor sum of exp(A cell) to order 24 in integers over 2^128; its errors never grow in the norm of P,
/// and are summed. Within a cell |f| <= the line through |f| at both ends + cell^2/8 sup|f''|. After the last cell,
/// |r x| <= sqrt(r P^-1 r') |x|_P, which decays.
///
/// A delay T is expanded: A is the companion matrix of D0 = open + feedback R, with R the Taylor polynomial of e^(-Ts)
/// of degree k = delay_order. The remainder, (-s)^(k+1) times a kernel of one sign and of integral T^(k+1)/(k+1)!, maps
/// a response to one of at most lambda = T^(k+1)/(k+1)! |s^(k+1) feedback/D0|_1 times its size (a jump at 0 counts).
/// Hence lambda < 1 must hold, and all bounds are divided by 1 - lambda.
/// @throws std::runtime_error with the reason if the witness proves nothing, or a number is out of range.
GainBounds upper_gains(const LoopWitness& loop);

}  // namespace swarmcert::check
