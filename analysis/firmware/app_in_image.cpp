#include "analysis/firmware/app_in_image.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string_view>
#include <utility>

#include "analysis/firmware/app_layout.h"
#include "analysis/firmware/float_blocks.h"

namespace swarmcert::firmware {
namespace {

// Offsets from CortexM::kArguments of what the replaced functions return and of the arguments of the controller.
constexpr std::uint32_t kNow = 0, kBattery = 4, kSizeOfPeer = 8, kEstimate = 16, kPeersAt = 64,
                        kSetpoint = 0x400, kSensors = 0x500, kState = 0x600, kControl = 0x700,
                        kInputsEnd = 0x800;
/// Where the code below is placed: the last page of the flash.
constexpr std::uint32_t kCodeAt = CortexM::kFlash + CortexM::kFlashSize - 4096;

/// Replacements of the firmware's functions, in Thumb code.
constexpr unsigned char kReplacements[] = {
    // 0x00 xTaskGetTickCount: ldr r0, =kNow; ldr r0, [r0]; bx lr
    0x01, 0x48, 0x00, 0x68, 0x70, 0x47, 0x00, 0xbf, 0x00, 0x80, 0x02, 0x20,
    // 0x0c pmGetBatteryVoltage: ldr r0, =kBattery; ldr r0, [r0]; vmov s0, r0; bx lr
    0x02, 0x48, 0x00, 0x68, 0x00, 0xee, 0x10, 0x0a, 0x70, 0x47, 0x00, 0xbf, 0x04, 0x80, 0x02, 0x20,
    // 0x1c usecTimestamp, the same number: ldr.w r0, =kNow; ldr r0, [r0]; movs r1, #0; bx lr
    0x5f, 0xf8, 0x18, 0x00, 0x00, 0x68, 0x00, 0x21, 0x70, 0x47, 0x00, 0xbf,
    // 0x28 peerLocalizationGetPositionByIdx: ldr r1, =kSizeOfPeer; ldr r2, [r1]; muls r0, r2; add r0, r1;
    //      adds r0, #kPeersAt - kSizeOfPeer; bx lr
    0x02, 0x49, 0x0a, 0x68, 0x50, 0x43, 0x08, 0x44, 0x38, 0x30, 0x70, 0x47, 0x08, 0x80, 0x02, 0x20,
    // 0x38 logGetFloat: cmp r0, #7; it hi; movhi r0, #7; ldr r1, =kEstimate; ldr.w r0, [r1, r0, lsl #2]; vmov s0, r0;
    //      bx lr
    0x07, 0x28, 0x88, 0xbf, 0x07, 0x20, 0x03, 0x49, 0x51, 0xf8, 0x20, 0x00, 0x00, 0xee, 0x10, 0x0a, 0x70,
    0x47, 0x00, 0xbf, 0x10, 0x80, 0x02, 0x20,
    // 0x50 logGetVarId: the place of a hash of both names in a table, 7 if it is not there.
    //      push {r4, r5, lr}; movs r2, #0; movs r4, #2
    0x30, 0xb5, 0x00, 0x22, 0x02, 0x24,
    //      next: ldrb.w r3, [r0], #1; cbz r3, end; lsls r5, r2, #5; subs r2, r5, r2; adds r2, r2, r3; b next
    0x10, 0xf8, 0x01, 0x3b, 0x1b, 0xb1, 0x55, 0x01, 0xaa, 0x1a, 0xd2, 0x18, 0xf8, 0xe7,
    //      end: adds r2, #46; mov r0, r1; subs r4, #1; bne next; adr r0, table; movs r4, #0
    0x2e, 0x32, 0x08, 0x46, 0x01, 0x3c, 0xf4, 0xd1, 0x05, 0xa0, 0x00, 0x24,
    //      look: ldr.w r3, [r0], #4; cmp r3, r2; beq found; adds r4, #1; cmp r4, #6; bne look; movs r4, #7
    0x50, 0xf8, 0x04, 0x3b, 0x93, 0x42, 0x03, 0xd0, 0x01, 0x34, 0x06, 0x2c, 0xf8, 0xd1, 0x07, 0x24,
    //      found: mov r0, r4; pop {r4, r5, pc}; table: stateEstimate x, y, z, vx, vy, vz
    0x20, 0x46, 0x30, 0xbd, 0x7f, 0x74, 0x31, 0x9f, 0x80, 0x74, 0x31, 0x9f, 0x81, 0x74, 0x31, 0x9f, 0x37,
    0x16, 0xfd, 0x46, 0x38, 0x16, 0xfd, 0x46, 0x39, 0x16, 0xfd, 0x46};

constexpr char kController[] = "controllerOutOfTree", kInit[] = "controllerOutOfTreeInit",
               kTest[] = "controllerOutOfTreeTest", kTask[] = "appMain",
               kParametersObject[] = "swarmcert_parameters", kStatusObject[] = "swarmcert_status",
               kLayout[] = "swarmcert_layout",
               kSettings[] = "_ZN9swarmcert9crazyflie12_GLOBAL__N_18settingsE";
constexpr std::uint32_t kParametersSize = 32, kStatusSize = 20;
constexpr std::string_view kOwnNames[] = {kController,       kInit,        kTest, kLayout, kSettings,
                                          kParametersObject, kStatusObject};
/// The replaced functions, by their offsets in kReplacements.
constexpr std::pair<const char*, std::uint32_t> kReplaced[] = {
    {"xTaskGetTickCount", 0x00}, {"pmGetBatteryVoltage", 0x0c},
    {"usecTimestamp", 0x1c},     {"peerLocalizationGetPositionByIdx", 0x28},
    {"logGetFloat", 0x38},       {"logGetVarId", 0x50}};
constexpr const char* kDelays[] = {"vTaskDelayUntil", "xTaskDelayUntil"};

template <class T>
T value_at(const std::string& bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

template <class T>
void put(std::string& bytes, std::size_t offset, const T& value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

template <std::size_t kN>
void put_all(std::string& bytes, std::size_t offset, const std::array<float, kN>& values) {
  for (std::size_t i = 0; i < kN; ++i) put(bytes, offset + 4 * i, values[i]);
}

/// Instruction B.W from `at` to `to`.
std::string jump(std::uint32_t at, std::uint32_t to) {
  const std::uint32_t offset = to - (at + 4), sign = offset >> 31;
  const std::uint32_t j1 = (~(offset >> 23) ^ sign) & 1u, j2 = (~(offset >> 22) ^ sign) & 1u;
  std::string code(4, '\0');
  put(code, 0, static_cast<std::uint16_t>(0xf000u | sign << 10 | (offset >> 12 & 0x3ffu)));
  put(code, 2, static_cast<std::uint16_t>(0x9000u | j1 << 13 | j2 << 11 | (offset >> 1 & 0x7ffu)));
  return code;
}

/// A float's word, where NaN has one form.
std::uint32_t word_at(const std::string& bytes, std::size_t offset) {
  const auto x = value_at<float>(bytes, offset);
  return std::isnan(x) ? 0x7fc00000u : float_bits(x);
}

AppParameters parameters_of(const std::string& bytes) {
  AppParameters p{
      value_at<std::uint8_t>(bytes, 0), value_at<std::uint8_t>(bytes, 1), value_at<float>(bytes, 4), {}};
  for (std::size_t i = 0; i < p.gains.size(); ++i) p.gains[i] = value_at<float>(bytes, 8 + 4 * i);
  return p;
}

std::vector<std::uint32_t> layout_of(const ElfImage& image) {
  const Symbol* const symbol = image.find(kLayout);
  const std::string bytes = symbol == nullptr ? "" : image.bytes_at(symbol->address, 2 * kLayoutEntries);
  std::vector<std::uint32_t> layout;
  for (std::size_t i = 0; i + 2 <= bytes.size(); i += 2) layout.push_back(value_at<std::uint16_t>(bytes, i));
  if (layout.size() != kLayoutEntries || layout[kLayoutVersion] != 1)
    throw NotRun("its table swarmcert_layout is missing, or of another version of the app");
  const auto fits = [&layout](AppLayout size, std::uint32_t most, std::initializer_list<AppLayout> members,
                              std::uint32_t bytes_of_member) {
    if (layout[size] > most) return false;
    return std::all_of(members.begin(), members.end(),
                       [&](AppLayout member) { return layout[member] + bytes_of_member <= layout[size]; });
  };
  const bool is_sound =
      fits(kSetpointSize, kSensors - kSetpoint,
           {kSetpointRates, kSetpointPosition, kSetpointVelocity, kSetpointAcceleration}, 12) &&
      fits(kSetpointSize, kSensors - kSetpoint, {kSetpointYaw, kSetpointThrust}, 4) &&
      fits(kSetpointSize, kSensors - kSetpoint, {kSetpointQuaternion}, 16) &&
      fits(kSetpointSize, kSensors - kSetpoint, {kModeX, kModeY, kModeZ, kModeYaw, kModeQuaternion},
           layout[kModeSize]) &&
      fits(kSensorsSize, kState - kSensors, {kSensorsGyro}, 12) &&
      fits(kStateSize, kControl - kState, {kStatePosition, kStateVelocity}, 12) &&
      fits(kStateSize, kControl - kState, {kStateQuaternion}, 16) &&
      fits(kControlSize, kInputsEnd - kControl, {kControlForces}, 16) &&
      fits(kControlSize, kInputsEnd - kControl, {kControlMode}, layout[kControlModeSize]) &&
      fits(kPeerSize, (kSetpoint - kPeersAt) / kAppPeers, {kPeerPosition}, 12) &&
      fits(kPeerSize, (kSetpoint - kPeersAt) / kAppPeers, {kPeerStamp}, 4) &&
      fits(kPeerSize, (kSetpoint - kPeersAt) / kAppPeers, {kPeerId}, 1) && layout[kPeers] == kAppPeers &&
      layout[kModeSize] >= 1 && layout[kModeSize] <= 4 && layout[kControlModeSize] >= 1 &&
      layout[kControlModeSize] <= 4;
  if (!is_sound) throw NotRun("its table swarmcert_layout is not that of a Crazyflie's firmware");
  return layout;
}

}  // namespace

void load(CortexM& target, const ElfImage& image) {
  for (const Segment& segment : image.segments) {
    // The stack and arguments of the calls must not overlap the program's own memory.
    if (segment.address < CortexM::kRam + CortexM::kRamSize + 32 * 1024 &&
        std::uint64_t{segment.address} + segment.bytes_in_use > CortexM::kRam + CortexM::kRamSize &&
        segment.address >= CortexM::kRam)
      throw NotRun("the program takes more RAM than an STM32F405 has");
    if (!segment.bytes.empty()) target.write(segment.address, segment.bytes);
  }
}

bool is_name_of_app(const std::string& name) {
  const auto same = [&name](const auto& one) { return name == one; };
  return name.find("swarmcert") != std::string::npos || name == kTask ||
         std::any_of(std::begin(kOwnNames), std::end(kOwnNames), same) ||
         std::any_of(std::begin(kDelays), std::end(kDelays), same) ||
         std::any_of(std::begin(kReplaced), std::end(kReplaced),
                     [&](const auto& one) { return same(one.first); });
}

bool holds_app(const ElfImage& image) {
  return std::any_of(std::begin(kOwnNames), std::end(kOwnNames),
                     [&image](std::string_view name) { return image.find(std::string(name)) != nullptr; });
}

AppInImage::AppInImage(const ElfImage& image) : image_(image), layout_(layout_of(image)) {
  for (const char* const name : {kController, kInit, kTest, kTask, kSettings}) address(name);
  const Symbol* const parameters = image.find(kParametersObject);
  const std::string stored =
      parameters == nullptr ? "" : image.bytes_at(parameters->address, kParametersSize);
  if (stored.empty() || image.find(kStatusObject) == nullptr)
    throw NotRun("it has no symbol of swarmcert_parameters or swarmcert_status");
  at_start_ = parameters_of(stored);
  load(machine_, image);
  for (const Segment& segment : image.segments)
    if (segment.address <= kCodeAt + 4096 && std::uint64_t{segment.address} + segment.bytes.size() > kCodeAt)
      throw NotRun("it leaves no flash for the replaced functions of the firmware");
  machine_.write(kCodeAt, std::string(reinterpret_cast<const char*>(kReplacements), sizeof kReplacements));
  for (const auto& [name, offset] : kReplaced) {
    const std::uint32_t at = address(name);
    if (image.find(name)->size < 4) throw NotRun(fmt::format("{} is too short to be replaced", name));
    machine_.write(at, jump(at, kCodeAt + offset));
  }
  delay_ = address(kDelays[image.find(kDelays[0]) != nullptr ? 0 : 1]);
  machine_.call(address(kInit), {0, 0, 0, 0}, 0);
}

std::uint32_t AppInImage::address(const char* name) const {
  const Symbol* const symbol = image_.find(name);
  if (symbol == nullptr) throw NotRun(fmt::format("it has no symbol of {}", name));
  return symbol->address;
}

std::string AppInImage::inputs_of(const Tick& tick) const {
  std::string bytes(kInputsEnd, '\0');
  put(bytes, kNow, tick.now_ms);
  put(bytes, kBattery, tick.battery_V);
  put(bytes, kSizeOfPeer, layout_[kPeerSize]);
  put_all(bytes, kEstimate, tick.estimate);
  for (std::size_t i = tick.estimate.size(); i < 8; ++i) put(bytes, kEstimate + 4 * i, 0x7fc00000u);
  for (std::size_t i = 0; i < tick.peers.size(); ++i) {
    const std::size_t at = kPeersAt + i * layout_[kPeerSize];
    put(bytes, at + layout_[kPeerId], tick.peers[i].id);
    put(bytes, at + layout_[kPeerStamp], tick.peers[i].stamp_ms);
    put_all(bytes, at + layout_[kPeerPosition], tick.peers[i].position_W_m);
  }
  put(bytes, kSetpoint + layout_[kSetpointYaw], tick.yaw_deg);
  put(bytes, kSetpoint + layout_[kSetpointThrust], tick.thrust);
  put_all(bytes, kSetpoint + layout_[kSetpointRates], tick.rates_deg_s);
  put_all(bytes, kSetpoint + layout_[kSetpointQuaternion], tick.wanted_quaternion);
  put_all(bytes, kSetpoint + layout_[kSetpointPosition], tick.position_m);
  put_all(bytes, kSetpoint + layout_[kSetpointVelocity], tick.velocity_m_s);
  put_all(bytes, kSetpoint + layout_[kSetpointAcceleration], tick.acceleration_m_s2);
  const AppLayout modes[] = {kModeX, kModeY, kModeZ, kModeYaw, kModeQuaternion};
  for (std::size_t i = 0; i < tick.modes.size(); ++i)
    put(bytes, kSetpoint + layout_[modes[i]], tick.modes[i]);
  put_all(bytes, kSensors + layout_[kSensorsGyro], tick.gyro_deg_s);
  put_all(bytes, kState + layout_[kStateQuaternion], tick.state_quaternion);
  put_all(bytes, kState + layout_[kStatePosition], tick.state_position_m);
  put_all(bytes, kState + layout_[kStateVelocity], tick.state_velocity_m_s);
  return bytes;
}

TickResult AppInImage::run(const Tick& tick) {
  machine_.write(CortexM::kArguments, inputs_of(tick));
  std::string parameters(kParametersSize, '\0');
  put(parameters, 0, tick.parameters.enable);
  put(parameters, 1, tick.parameters.own_kind);
  put(parameters, 4, tick.parameters.mass_kg);
  put_all(parameters, 8, tick.parameters.gains);
  machine_.write(address(kParametersObject), parameters);
  machine_.write(address(kStatusObject), std::string(1, static_cast<char>(tick.self_test)));
  if (tick.initialises) machine_.call(address(kInit), {0, 0, 0, 0}, 0);
  if (tick.is_of_network) {
    machine_.call_until_second(address(kTask), delay_);
  } else {
    const std::uint32_t at = CortexM::kArguments;
    machine_.call(address(kController), {at + kControl, at + kSetpoint, at + kSensors, at + kState},
                  tick.step);
  }
  const std::string control = machine_.read(CortexM::kArguments + kControl, layout_[kControlSize]);
  const std::string status = machine_.read(address(kStatusObject), kStatusSize);
  std::uint32_t mode = 0;
  std::memcpy(&mode, control.data() + layout_[kControlMode], layout_[kControlModeSize]);
  const std::size_t forces = layout_[kControlForces];
  const auto byte = [&status](std::size_t i) { return std::uint32_t{static_cast<unsigned char>(status[i])}; };
  return {word_at(control, forces),
          word_at(control, forces + 4),
          word_at(control, forces + 8),
          word_at(control, forces + 12),
          mode,
          byte(0),
          byte(1),
          byte(2),
          byte(3),
          value_at<std::uint16_t>(status, 4),
          word_at(status, 8),
          word_at(status, 12),
          value_at<std::uint32_t>(status, 16)};
}

std::vector<std::uint32_t> AppInImage::settings(std::size_t count) {
  const std::string bytes = machine_.read(address(kSettings), static_cast<std::uint32_t>(4 * count));
  std::vector<std::uint32_t> words(count);
  std::memcpy(words.data(), bytes.data(), bytes.size());
  return words;
}

bool AppInImage::passes_test() {
  machine_.write(address(kStatusObject), std::string(1, '\0'));
  return (machine_.call(address(kTest), {0, 0, 0, 0}, 0) & 0xffu) != 0;
}

}  // namespace swarmcert::firmware
