/* The part of the interface that the app uses; written for this project. */
#pragma once

#include <stdint.h>

typedef uint32_t TickType_t;

/* One tick is one millisecond. */
#define M2T(ms) ((TickType_t)(ms))
#define T2M(ticks) ((uint32_t)(ticks))
