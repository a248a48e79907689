/* Data shared by the controller, the network task and the parameter system. Included from C and C++. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum SwarmcertEnable { kSwarmcertOff = 0, kSwarmcertComputeOnly = 1, kSwarmcertApply = 2 };

enum SwarmcertSelfTest {
  kSwarmcertUntested = 0,
  kSwarmcertPassed = 1,
  kSwarmcertFused = 2,       /* built with contraction: the flags of src/Kbuild did not take effect */
  kSwarmcertOtherBits = 3,   /* a test vector gives different bits */
  kSwarmcertOtherWeights = 4 /* the weights in flash differ from the exported ones */
};

/* Set from the ground station. Gains are shared by x and y and separate for z. */
struct SwarmcertParameters {
  uint8_t enable; /* SwarmcertEnable; other values mean kSwarmcertOff */
  uint8_t own_kind;
  float mass_kg;
  float kp_xy, kp_z; /* 1/s^2 */
  float kd_xy, kd_z; /* 1/s */
  float ki_xy, ki_z; /* 1/s^3 */
};

/* Each member has a single writer, the controller or the network task, and is read and written atomically. */
struct SwarmcertStatus {
  uint8_t self_test;     /* SwarmcertSelfTest */
  uint8_t prediction;    /* controller::PredictionStatus */
  uint8_t neighbours;    /* number used in the prediction, including fading ones */
  uint8_t faults;        /* sum of controller::Fault */
  uint16_t network_us;   /* duration of the last evaluation, including preemption */
  float predicted_N;     /* f_a_hat, upwards */
  float applied_N;       /* the part that the controller applied */
  uint32_t predicted_ms; /* when f_a_hat was computed */
};

extern struct SwarmcertParameters swarmcert_parameters;
extern volatile struct SwarmcertStatus swarmcert_status;
