/* See FreeRTOS.h. */
#pragma once

#include "stabilizer_types.h"

#define PEER_LOCALIZATION_MAX_NEIGHBORS 10

typedef struct {
  uint8_t id; /* 0: an empty slot */
  point_t pos;
} peerLocalizationOtherPosition_t;

peerLocalizationOtherPosition_t* peerLocalizationGetPositionByIdx(uint8_t index);
