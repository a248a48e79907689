/* See FreeRTOS.h. Groups are visible to the test as stub_log_<group>. */
#pragma once

#include <stdint.h>

typedef uint16_t logVarId_t;
logVarId_t logGetVarId(const char* group, const char* name);
float logGetFloat(logVarId_t id);

#define LOG_UINT8 1
#define LOG_UINT16 2
#define LOG_FLOAT 7

struct stub_variable {
  uint8_t type;
  const char* name;
  const volatile void* address;
};

#define LOG_ADD(TYPE, NAME, ADDRESS) {(TYPE), #NAME, (ADDRESS)},
#define LOG_GROUP_START(NAME) const struct stub_variable stub_log_##NAME[] = {
#define LOG_GROUP_STOP(NAME) \
  { 0, 0, 0 }                \
  }                          \
  ;
