#include "stub.h"

#include <cstring>

namespace stub = swarmcert::tests::stub;

extern "C" {

TickType_t xTaskGetTickCount() { return stub::now_ms; }
void vTaskDelayUntil(TickType_t*, TickType_t) {}
std::uint64_t usecTimestamp() { return std::uint64_t{1000} * stub::now_ms; }
float pmGetBatteryVoltage() { return stub::battery_V; }
peerLocalizationOtherPosition_t* peerLocalizationGetPositionByIdx(std::uint8_t index) {
  return &stub::peers[index];
}

logVarId_t logGetVarId(const char* group, const char* name) {
  static const char* const names[] = {"x", "y", "z", "vx", "vy", "vz"};
  for (std::uint16_t i = 0; i < 6; ++i) {
    if (std::strcmp(group, "stateEstimate") == 0 && std::strcmp(name, names[i]) == 0) return i;
  }
  return 0xffff;
}
float logGetFloat(logVarId_t id) { return stub::own[id]; }
}
