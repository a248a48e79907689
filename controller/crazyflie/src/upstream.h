/// @file The part of the stock firmware's interface that the app uses.
#pragma once

#if __cplusplus < 201703L
#error "the app needs C++17, which arm-none-eabi-g++ speaks by default from version 11 on"
#endif

extern "C" {
#include "FreeRTOS.h"
#include "controller.h"
#include "log.h"
#include "peer_localization.h"
#include "stabilizer_types.h"
#include "task.h"
#include "usec_time.h"

void appMain(void);
float pmGetBatteryVoltage(void);  // pm.h would also include the board's pin definitions
}
