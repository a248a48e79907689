/// @file Discrete Fourier transform of flights, with the coefficients sorted into frequency bands.
///
/// A stretch is a run of records without a gap. Its transform is real and orthonormal, so that products of transforms
/// are those of the series in time, faded in and out within 1 s: a jump from the last record to the first would be one
/// direction in all bands, in which a slow disturbance and slow set points look correlated. Noise of a stationary
/// process has independent coefficients, whose variance depends on the band only (Whittle 1953).
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace swarmcert::evidence {

struct Stretch {
  int first = 0, count = 0;  ///< records
  double step_s = 0;
};

/// Returns the runs of records for which `is_used` is not zero, without those shorter than a second. They are cut to
/// lengths with no prime factor above 5.
/// @param starts not zero for records that do not follow their predecessor
std::vector<Stretch> stretches(const std::vector<double>& times_s, const std::vector<char>& is_used,
                               const std::vector<char>& starts);

/// Coefficients of one band, of stretches with the same sampling.
struct Band {
  int source = 0;     ///< index of the sampling: noise differs between samplings
  double step_s = 0;  ///< of the sampling
  double frequency_hz = 0;
  int first = 0, count = 0;  ///< rows of the transform
};

/// The bands of a set of stretches: four below 0.3 Hz, then four per octave up to 25 Hz, above which forces in flight
/// carry no information about effects.
class Spectral {
 public:
  /// @param stretches of all tracks
  explicit Spectral(std::vector<Stretch> stretches);

  const std::vector<Band>& bands() const { return bands_; }
  int rows() const { return rows_; }
  /// Writes the part of a transform that belongs to one stretch to its rows of `to` [rows()].
  /// @param series the records of the stretch
  void transform(std::size_t stretch, const float* series, float* to) const;

 private:
  std::vector<Stretch> stretches_;
  std::vector<Band> bands_;
  int rows_ = 0;
  /// Row of the real and of the imaginary part of each kept frequency of each stretch; -1: identically zero.
  std::vector<std::vector<std::pair<int, int>>> row_of_;
};

}  // namespace swarmcert::evidence
