/* What the controller, the network's task and the parameter system share. C and C++ read it. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum SwarmcertEnable { kSwarmcertOff = 0, kSwarmcertComputeOnly = 1, kSwarmcertApply = 2 };

enum SwarmcertSelfTest {
  kSwarmcertUntested = 0,
  kSwarmcertPassed = 1,
  kSwarmcertFused = 2,       /* built with contraction: the flags of src/Kbuild were lost */
  kSwarmcertOtherBits = 3,   /* a golden vector gives other bits */
  kSwarmcertOtherWeights = 4 /* the weights in flash are not those that were exported */
};

/* Set from the ground. Per-axis gains stand for x and y together, then z. */
struct SwarmcertParameters {
  uint8_t enable; /* SwarmcertEnable; anything else is kSwarmcertOff */
  uint8_t own_kind;
  float mass_kg;
  float kp_xy, kp_z; /* 1/s^2 */
  float kd_xy, kd_z; /* 1/s */
  float ki_xy, ki_z; /* 1/s^3 */
};

/* One writer each: the controller, or the network's task. Words are read and written whole. */
struct SwarmcertStatus {
  uint8_t self_test;     /* SwarmcertSelfTest */
  uint8_t prediction;    /* controller::PredictionStatus */
  uint8_t neighbours;    /* that count in the prediction, fading ones included */
  uint8_t faults;        /* sum of controller::Fault */
  uint16_t network_us;   /* last execution of the networks, preemption included */
  float predicted_N;     /* f_a_hat, upwards */
  float applied_N;       /* what the controller used of it */
  uint32_t predicted_ms; /* when f_a_hat was computed */
};

extern struct SwarmcertParameters swarmcert_parameters;
extern volatile struct SwarmcertStatus swarmcert_status;
