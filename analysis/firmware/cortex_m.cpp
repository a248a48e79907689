#include "analysis/firmware/cortex_m.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <utility>

extern char** environ;

namespace swarmcert::firmware {
namespace {

// Memory above the arguments: the stack, then the code that enables the floating-point unit and to which calls return.
constexpr std::uint32_t kStackEnd = CortexM::kArguments + CortexM::kArgumentsSize + 8 * 1024;
constexpr std::uint32_t kCode = kStackEnd + 1024;
constexpr std::uint32_t kReturn = kCode + 10;
constexpr std::uint32_t kControlOfCoprocessors = 0xE000ED88, kFullAccess = 0xFu << 20;  // CPACR
/// str r1, [r0]; dsb; isb; nop
constexpr char kSwitchOn[] = "\x01\x60\xbf\xf3\x4f\x8f\xbf\xf3\x6f\x8f\x00\xbf";
constexpr int kStackPointer = 13, kLink = 14, kCounter = 15, kStatus = 25;
constexpr std::uint32_t kThumb = 1u << 24;  // of the program status register
/// Addresses without memory of a program, from and to.
constexpr std::pair<std::uint32_t, std::uint32_t> kNoMemory[] = {
    {CortexM::kFlash + CortexM::kFlashSize, CortexM::kRam}, {kCode + 4096, 0xffffffff}};

std::string hex(const std::string& bytes) {
  std::string text;
  for (const char c : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return text;
}

std::string word_bytes(std::uint32_t word) {
  std::string bytes(4, '\0');
  for (int i = 0; i < 4; ++i) bytes[static_cast<std::size_t>(i)] = static_cast<char>(word >> (8 * i));
  return bytes;
}

std::string from_hex(const std::string& digits, std::size_t size) {
  if (digits.size() != 2 * size || digits.find_first_not_of("0123456789abcdef") != std::string::npos)
    throw NotRun(fmt::format("QEMU answered '{}' where {} bytes were expected", digits.substr(0, 40), size));
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i)
    bytes += static_cast<char>(std::stoul(digits.substr(2 * i, 2), nullptr, 16));
  return bytes;
}

std::uint32_t word_of(const std::string& digits) {
  std::uint32_t word = 0;
  std::memcpy(&word, from_hex(digits, sizeof word).data(), sizeof word);
  return word;
}

bool lies_in(std::uint32_t address, std::size_t size, std::uint32_t first, std::uint32_t length) {
  return address >= first && address - first <= length && size <= length - (address - first);
}

}  // namespace

CortexM::CortexM() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) throw NotRun("no socket for QEMU");
  const char* const arguments[] = {
      "qemu-system-arm", "-M",   "netduinoplus2", "-nodefaults", "-display", "none",
      "-monitor",        "none", "-serial",       "none",        "-S",       "-gdb",
      "stdio",           nullptr};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], 0);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
  ::posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  const int error =
      ::posix_spawnp(&child_, arguments[0], &actions, nullptr, const_cast<char* const*>(arguments), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  socket_ = ends[0];
  if (error != 0) {
    child_ = -1;
    ::close(socket_);
    throw NotRun("qemu-system-arm is not installed (apt-get install qemu-system-arm)");
  }
  // Single registers can be set only after the processor description has been requested.
  request("qXfer:features:read:target.xml:0,ffb");
  request("qXfer:features:read:arm-m-profile.xml:0,ffb");
  need_ok(fmt::format("M{:x},{:x}:{}", kCode, sizeof kSwitchOn - 1,
                      hex(std::string(kSwitchOn, sizeof kSwitchOn - 1))));
  need_ok(fmt::format("Z0,{:x},2", kReturn));
  set_register(0, kControlOfCoprocessors);
  set_register(1, kFullAccess);
  if (run_from(kCode) != kReturn) throw NotRun("the floating-point unit was not switched on");
  // A program that reads a device, or the processor's own registers, could tell that it is being tested.
  for (const auto& [first, end] : kNoMemory) need_ok(fmt::format("Z4,{:x},{:x}", first, end - first));
}

CortexM::~CortexM() {
  if (socket_ >= 0) ::close(socket_);
  if (child_ > 0) {
    ::kill(child_, SIGKILL);
    int status = 0;
    ::waitpid(child_, &status, 0);
  }
}

char CortexM::next_byte() {
  while (taken_ == received_.size()) {
    pollfd waiting = {socket_, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, kMostSeconds * 1000);
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) throw NotRun(fmt::format("the call did not return within {} s", kMostSeconds));
    char buffer[4096];
    const ssize_t size = ::recv(socket_, buffer, sizeof buffer, 0);
    if (size <= 0)
      throw NotRun(
          "QEMU ended: the program faulted, or this qemu-system-arm lacks the machine netduinoplus2");
    received_.assign(buffer, static_cast<std::size_t>(size));
    taken_ = 0;
  }
  return received_[taken_++];
}

/// Returns the contents of the next packet, "$contents#checksum".
std::string CortexM::reply() {
  while (next_byte() != '$') {  // acknowledgements
  }
  std::string contents;
  for (char c = next_byte(); c != '#'; c = next_byte()) {
    contents += c;
    if (contents.size() > 65536) throw NotRun("QEMU's answer has no end");
  }
  next_byte();
  next_byte();
  ::send(socket_, "+", 1, MSG_NOSIGNAL);
  return contents;
}

std::string CortexM::request(const std::string& command) {
  unsigned sum = 0;
  for (const char c : command) sum += static_cast<unsigned char>(c);
  const std::string packet = fmt::format("${}#{:02x}", command, sum & 0xff);
  std::size_t sent = 0;
  while (sent < packet.size()) {
    const ssize_t size = ::send(socket_, packet.data() + sent, packet.size() - sent, MSG_NOSIGNAL);
    if (size <= 0) throw NotRun("QEMU ended before it was asked");
    sent += static_cast<std::size_t>(size);
  }
  return reply();
}

void CortexM::need_ok(const std::string& command) {
  const std::string answer = request(command);
  if (answer != "OK") throw NotRun(fmt::format("QEMU answered '{}' to '{}'", answer, command.substr(0, 40)));
}

void CortexM::set_register(int number, std::uint32_t value) {
  need_ok(fmt::format("P{:x}={}", number, hex(word_bytes(value))));
}

std::uint32_t CortexM::get_register(int number) { return word_of(request(fmt::format("p{:x}", number))); }

std::uint32_t CortexM::run_from(std::uint32_t address) {
  set_register(kStackPointer, kStackEnd - 8);  // the stack argument, aligned to eight bytes
  set_register(kLink, kReturn | 1u);
  set_register(kCounter, address & ~1u);
  set_register(kStatus, kThumb);
  request("c");
  return get_register(kCounter);
}

void CortexM::write(std::uint32_t address, const std::string& bytes) {
  if (!lies_in(address, bytes.size(), kFlash, kFlashSize) &&
      !lies_in(address, bytes.size(), kRam, kRamSize + kArgumentsSize))
    throw NotRun(
        fmt::format("{} bytes at {:#x} lie outside the memory of an STM32F405", bytes.size(), address));
  constexpr std::size_t kChunk = 1024;
  for (std::size_t at = 0; at < bytes.size(); at += kChunk) {
    const std::string chunk = bytes.substr(at, kChunk);
    need_ok(fmt::format("M{:x},{:x}:{}", address + at, chunk.size(), hex(chunk)));
  }
}

std::string CortexM::read(std::uint32_t address, std::uint32_t size) {
  std::string bytes;
  for (std::uint32_t at = 0; at < size;) {
    const std::uint32_t chunk = std::min<std::uint32_t>(size - at, 1024);
    bytes += from_hex(request(fmt::format("m{:x},{:x}", address + at, chunk)), chunk);
    at += chunk;
  }
  return bytes;
}

std::uint32_t CortexM::read_word(std::uint32_t address) {
  return word_of(request(fmt::format("m{:x},4", address)));
}

std::uint32_t CortexM::call(std::uint32_t address, const std::uint32_t (&in_registers)[4],
                            std::uint32_t on_stack) {
  for (int i = 0; i < 4; ++i) set_register(i, in_registers[i]);
  need_ok(fmt::format("M{:x},4:{}", kStackEnd - 8, hex(word_bytes(on_stack))));
  if (run_from(address) != kReturn) throw NotRun("the call stopped before it came back");
  return get_register(0);
}

void CortexM::call_until_second(std::uint32_t address, std::uint32_t callee) {
  if (watched_ == 0) need_ok(fmt::format("Z0,{:x},2", callee));
  watched_ = callee;
  if (run_from(address) != callee) throw NotRun("the task stopped before it waited for its period");
  set_register(kCounter, get_register(kLink) & ~1u);
  request("c");
  if (get_register(kCounter) != callee) throw NotRun("the task stopped before it waited for its next period");
}

}  // namespace swarmcert::firmware
