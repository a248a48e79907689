/* See FreeRTOS.h. The members that the app reads and writes, with the firmware's units. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

struct vec3_s {
  uint32_t timestamp; /* ms */
  float x, y, z;
};
typedef struct vec3_s point_t;    /* m */
typedef struct vec3_s velocity_t; /* m/s */
typedef struct vec3_s acc_t;

typedef struct {
  uint32_t timestamp;
  float roll, pitch, yaw; /* degrees, or degrees per second */
} attitude_t;

typedef struct {
  uint32_t timestamp;
  float x, y, z, w;
} quaternion_t;

typedef struct {
  float x, y, z;
} Axis3f;

typedef struct {
  Axis3f acc;  /* g */
  Axis3f gyro; /* degrees per second */
} sensorData_t;

typedef struct {
  attitude_t attitude;
  quaternion_t attitudeQuaternion;
  point_t position;
  velocity_t velocity;
  acc_t acc;
} state_t;

/* The firmware's mode_t, a name that hosts have for another type. */
enum stub_mode { modeDisable = 0, modeAbs, modeVelocity };

typedef struct {
  attitude_t attitude;
  attitude_t attitudeRate;
  quaternion_t attitudeQuaternion;
  float thrust;
  point_t position;
  velocity_t velocity;
  acc_t acceleration; /* m/s^2 */
  struct {
    enum stub_mode x, y, z, roll, pitch, yaw, quat;
  } mode;
} setpoint_t;

#define STABILIZER_NR_OF_MOTORS 4

typedef enum { controlModeLegacy = 0, controlModeForceTorque, controlModeForce } control_mode_t;

typedef struct {
  float normalizedForces[STABILIZER_NR_OF_MOTORS]; /* 0..1 */
  control_mode_t controlMode;
} control_t;

typedef uint32_t stabilizerStep_t;

#define RATE_MAIN_LOOP 1000
#define ATTITUDE_RATE 500
#define POSITION_RATE 100
#define RATE_DO_EXECUTE(RATE_HZ, TICK) ((TICK) % (RATE_MAIN_LOOP / (RATE_HZ)) == 0)
