/* The parameter and log group "swarmcert". In C, because the macros do not compile as C++ with -Werror. */
#include "shared.h"

#include "log.h"
#include "param.h"

/* Gains of controller/gains/crazyflie-small-nominal.toml. */
struct SwarmcertParameters swarmcert_parameters = {
    .enable = kSwarmcertOff,
    .own_kind = 0,
    .mass_kg = 0.034f,
    .kp_xy = 20.0f,
    .kp_z = 10.0f,
    .kd_xy = 10.0f,
    .kd_z = 5.0f,
    .ki_xy = 3.0f,
    .ki_z = 10.0f,
};
volatile struct SwarmcertStatus swarmcert_status;

/* The type is deduced from the variable, so it cannot be wrong. */
#define PARAM_TYPE(variable) _Generic((variable), uint8_t : PARAM_UINT8, float : PARAM_FLOAT)
#define LOG_TYPE(variable) _Generic((variable), uint8_t : LOG_UINT8, uint16_t : LOG_UINT16, float : LOG_FLOAT)
#define ADD_PARAM(name, member) \
  PARAM_ADD(PARAM_TYPE(swarmcert_parameters.member), name, &swarmcert_parameters.member)
#define ADD_LOG(name, member) LOG_ADD(LOG_TYPE(swarmcert_status.member), name, &swarmcert_status.member)

PARAM_GROUP_START(swarmcert)
ADD_PARAM(enable, enable)
ADD_PARAM(ownKind, own_kind)
ADD_PARAM(mass, mass_kg)
ADD_PARAM(kpXY, kp_xy)
ADD_PARAM(kpZ, kp_z)
ADD_PARAM(kdXY, kd_xy)
ADD_PARAM(kdZ, kd_z)
ADD_PARAM(kiXY, ki_xy)
ADD_PARAM(kiZ, ki_z)
PARAM_GROUP_STOP(swarmcert)

LOG_GROUP_START(swarmcert)
ADD_LOG(selfTest, self_test)
ADD_LOG(prediction, prediction)
ADD_LOG(neighbours, neighbours)
ADD_LOG(faults, faults)
ADD_LOG(us, network_us)
ADD_LOG(fz, predicted_N)
ADD_LOG(fzUsed, applied_N)
LOG_GROUP_STOP(swarmcert)
