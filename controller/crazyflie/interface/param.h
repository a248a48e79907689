/* See log.h; groups are visible to the test as stub_param_<group>. */
#pragma once

#include "log.h"

#define PARAM_UINT8 8
#define PARAM_FLOAT 6

#define PARAM_ADD(TYPE, NAME, ADDRESS) {(TYPE), #NAME, (ADDRESS)},
#define PARAM_GROUP_START(NAME) const struct stub_variable stub_param_##NAME[] = {
#define PARAM_GROUP_STOP(NAME) \
  { 0, 0, 0 }                  \
  }                            \
  ;
