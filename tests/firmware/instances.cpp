// What firmware links: explicit instantiations, so that the archive contains everything that the templates need.
#include "controller/flight_controller.h"
#include "controller/gain_conversion.h"
#include "controller/neighbours.h"

namespace swarmcert::nn {
template void evaluate(const Mlp<float>&, const float*, float*, float*);
template DeepSetStatus evaluate(const DeepSet<float>&, const float*, const Neighbour<float>*, int, float*,
                                const DeepSetWorkspace<float>&);
}  // namespace swarmcert::nn

namespace swarmcert::controller {
template FlightCommand<float> flight_step(const FlightSettings<float, PidGains<float>>&, FlightMemory<float>&,
                                          const Measured<float>&, const FlightReference<float>&,
                                          const Vector3<float>&, std::uint32_t, bool, const Vector3<float>&);
template FlightCommand<float> flight_step(const FlightSettings<float, CompositeGains<float>>&,
                                          FlightMemory<float>&, const Measured<float>&,
                                          const FlightReference<float>&, const Vector3<float>&, std::uint32_t,
                                          bool, const Vector3<float>&);
template Prediction<float> predict(const nn::DeepSet<float>&, const PredictionSettings<float>&,
                                   const Vector3<float>&, const Vector3<float>&, const NeighbourTrack<float>*,
                                   int, std::uint32_t, const Vector3<float>&,
                                   const nn::DeepSetWorkspace<float>&);
template TrackStatus update(NeighbourTrack<float>&, const VelocityFilter<float>&, const Vector3<float>&,
                            std::uint32_t);
template Allocation<float> allocation(const Rotors<float>&);
template Rotors<float> crazyflie_rotors(float, float);
template Heading<float> heading_of_yaw(float);
template float pwm_of_force(const ThrustMap<float>&, const float&, const float&);
template AxisComposite<float> to_composite(const AxisPid<float>&, const float&, const float&);
template AxisPid<float> to_pid(const float&, const float&, const float&);
template AxisPid<float> to_pid(const AxisForceGains<float>&, const float&);
}  // namespace swarmcert::controller
