#include "nn/base/file_io.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& what, const std::string& hint = "") {
  throw InputError({path, "", "", "", what, hint});
}

[[noreturn]] void refuse_with_errno(const std::string& path, const std::string& what) {
  refuse(path, what + " (" + std::strerror(errno) + ")");
}

/// An owning file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }
  bool is_open() const { return number_ >= 0; }

 private:
  int number_;
};

/// Returns a descriptor that the caller closes. Opening a named pipe does not wait for a writer.
int open_to_read(const std::string& path) {
  const int number = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (number < 0) refuse_with_errno(path, "cannot be opened");
  return number;
}

struct stat status_of(const Descriptor& file, const std::string& path) {
  struct stat status = {};
  if (::fstat(file.number(), &status) != 0) refuse_with_errno(path, "cannot be read");
  if (S_ISDIR(status.st_mode)) refuse(path, "is a folder", "name a file in it");
  // A pipe blocks until somebody writes to it, and can be read only once.
  if (S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode))
    refuse(path, "is a pipe", "write its contents to a file and name that");
  return status;
}

/// Returns the next bytes of the file, in `block`; none at its end.
std::string_view read_block(const Descriptor& file, const std::string& path,
                            std::array<char, 1 << 16>& block) {
  ssize_t count;
  do count = ::read(file.number(), block.data(), block.size());
  while (count < 0 && errno == EINTR);
  if (count < 0) refuse_with_errno(path, "cannot be read");
  return {block.data(), static_cast<std::size_t>(count)};
}

bool write_all(int descriptor, std::string_view contents) {
  while (!contents.empty()) {
    const ssize_t written = ::write(descriptor, contents.data(), contents.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    contents.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

[[noreturn]] void refuse_existing(const std::string& path) {
  refuse(path, "the file exists", "replace it with --force, or choose another name");
}

/// Syncs the folder so that the rename survives a power failure. Failure is ignored: not every file system supports it,
/// and the file is complete in any case.
void sync_folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.is_open()) ::fsync(descriptor.number());
}

/// Moves `temporary` to `path`; without `overwrite`, keeps a file that has appeared meanwhile. Returns 0 or an errno.
int move_into_place(const std::string& temporary, const std::string& path, bool overwrite) {
  if (!overwrite) {
    if (::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0) return 0;
    if (errno != EINVAL && errno != ENOSYS) return errno;
    if (::access(path.c_str(), F_OK) == 0) return EEXIST;  // the file system cannot do both atomically
  }
  return std::rename(temporary.c_str(), path.c_str()) == 0 ? 0 : errno;
}

class Sha256 {
 public:
  Sha256() { require(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr)); }
  void add(std::string_view bytes) { require(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size())); }
  /// Ends the hash.
  std::string hex() {
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned int size = 0;
    require(EVP_DigestFinal_ex(context_.get(), digest, &size));
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    for (unsigned int i = 0; i < size; ++i) {
      text += kDigits[digest[i] >> 4];
      text += kDigits[digest[i] & 15];
    }
    return text;
  }

 private:
  static void require(int result) {
    if (result != 1) throw std::runtime_error("sha256: OpenSSL has no SHA-256 in this configuration");
  }

  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_{EVP_MD_CTX_new(), EVP_MD_CTX_free};
};

}  // namespace

std::string read_file(const std::string& path, std::size_t limit_bytes) {
  const Descriptor file(open_to_read(path));
  const struct stat status = status_of(file, path);
  const auto refuse_size = [&] { refuse(path, "is larger than " + std::to_string(limit_bytes) + " bytes"); };
  std::string contents;
  if (S_ISREG(status.st_mode)) {
    if (static_cast<std::uintmax_t>(status.st_size) > limit_bytes) refuse_size();
    contents.reserve(static_cast<std::size_t>(status.st_size));
  }
  std::array<char, 1 << 16> block;
  for (;;) {  // to the end, not to st_size: a device has no size, and a log may still grow
    const std::string_view bytes = read_block(file, path, block);
    if (bytes.empty()) return contents;
    if (bytes.size() > limit_bytes - contents.size()) refuse_size();
    contents += bytes;
  }
}

void write_file(const std::string& path, std::string_view contents, bool overwrite) {
  if (path == "-") {
    std::fflush(stdout);
    if (!write_all(STDOUT_FILENO, contents)) refuse_with_errno("standard output", "cannot be written");
    return;
  }
  struct stat status = {};
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) refuse(path, "is a folder", "name a file in it");
    if (!S_ISREG(status.st_mode)) {  // devices and pipes are written to, never replaced
      const Descriptor device(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
      if (!device.is_open() || !write_all(device.number(), contents))
        refuse_with_errno(path, "cannot be written");
      return;
    }
    if (!overwrite) refuse_existing(path);
  }

  std::string temporary;
  int number = -1;
  for (int attempt = 0; attempt < 100 && number < 0; ++attempt) {
    temporary = path + ".part-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    number = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (number < 0 && errno != EEXIST) break;
  }
  if (number < 0) refuse_with_errno(path, "cannot be created");
  bool written;
  int error;
  {
    const Descriptor file(number);
    written = write_all(file.number(), contents) && ::fsync(file.number()) == 0;
    error = errno;
  }
  if (written) error = move_into_place(temporary, path, overwrite);
  if (!written || error != 0) {
    ::unlink(temporary.c_str());
    if (written && error == EEXIST) refuse_existing(path);
    errno = error;
    refuse_with_errno(path, "cannot be written");
  }
  sync_folder_of(path);
}

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.hex();
}

std::string sha256_of_file(const std::string& path) {
  const Descriptor file(open_to_read(path));
  // A device may have no end.
  if (!S_ISREG(status_of(file, path).st_mode)) refuse(path, "is a device", "name a file");
  Sha256 hash;
  std::array<char, 1 << 16> block;
  for (;;) {
    const std::string_view bytes = read_block(file, path, block);
    if (bytes.empty()) return hash.hex();
    hash.add(bytes);
  }
}

}  // namespace swarmcert::files
