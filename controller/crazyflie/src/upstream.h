/// @file The stock firmware's interface, as far as the app uses it.
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
float pmGetBatteryVoltage(void);  // pm.h would bring the board's pins with it
}
