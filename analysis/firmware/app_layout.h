/// @file The table `swarmcert_layout` of the Crazyflie app (controller/crazyflie/src/flight.cpp): where the firmware
/// with which it was compiled has the members that it uses, in bytes.
#pragma once

namespace swarmcert::firmware {

enum AppLayout {
  kLayoutVersion,
  kSetpointSize,
  kSetpointYaw,
  kSetpointRates,
  kSetpointQuaternion,
  kSetpointThrust,
  kSetpointPosition,
  kSetpointVelocity,
  kSetpointAcceleration,
  kModeX,
  kModeY,
  kModeZ,
  kModeYaw,
  kModeQuaternion,
  kModeSize,
  kSensorsSize,
  kSensorsGyro,
  kStateSize,
  kStateQuaternion,
  kStatePosition,
  kStateVelocity,
  kControlSize,
  kControlForces,
  kControlMode,
  kControlModeSize,
  kPeerSize,
  kPeerId,
  kPeerPosition,
  kPeerStamp,
  kPeers,
  kLayoutEntries
};

}  // namespace swarmcert::firmware
