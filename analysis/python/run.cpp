#include "analysis/python/run.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "analysis/cli/host.h"
#include "analysis/commands/run_command.h"
#include "analysis/python/network.h"

namespace py = pybind11;

namespace swarmcert::python {
namespace {

using analysis::Host;

constexpr std::chrono::milliseconds kTick{20};

/// State shared by the threads of the command and the calling thread.
struct Shared {
  std::mutex mutex;
  std::condition_variable changed;
  bool has_ended = false;
  int done = 0, total = 0;  ///< total is 0 if there is no new report
  std::string what;
};

/// Runs the command on its own thread; ends it if the caller leaves early.
class Worker {
 public:
  Worker(Host& host, Shared& shared, std::vector<std::string> words)
      : host_(host), words_(std::move(words)), thread_([this, &shared] { work(shared); }) {}
  ~Worker() {
    if (!thread_.joinable()) return;
    interrupt();
    join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void interrupt() { host_.interrupted = host_.stop = true; }

  void join() {
    const py::gil_scoped_release release;
    thread_.join();
  }

  std::exception_ptr error;
  int code = 0;

 private:
  void work(Shared& shared) {
    try {
      const analysis::HostScope scope(host_);
      std::vector<const char*> argv = {"swarmcert"};
      for (const std::string& word : words_) argv.push_back(word.c_str());
      code = analysis::run_command(static_cast<int>(argv.size()), argv.data());
    } catch (...) {
      error = std::current_exception();
    }
    const std::lock_guard<std::mutex> lock(shared.mutex);
    shared.has_ended = true;
    shared.changed.notify_all();
  }

  Host& host_;
  const std::vector<std::string> words_;
  std::thread thread_;
};

/// One tick: waits without the interpreter lock and takes new progress reports.
/// @return whether the command has ended.
bool wait(Shared& shared, Host& host, int& done, int& total, std::string& what) {
  const py::gil_scoped_release release;
  std::unique_lock<std::mutex> lock(shared.mutex);
  shared.changed.wait_for(lock, kTick, [&shared] { return shared.has_ended; });
  const double deadline_s = host.deadline_s;
  if (deadline_s > 0 && analysis::steady_s() >= deadline_s) host.stop = true;
  done = shared.done;
  total = shared.total;
  what = shared.what;
  shared.total = 0;
  return shared.has_ended;
}

}  // namespace

py::dict run(const std::vector<std::string>& words, const py::object& network,
             const std::optional<std::string>& certificate, const py::object& progress) {
  Host host;
  if (!network.is_none()) host.network = network_of(network.cast<py::dict>());
  host.certificate = certificate;
  Shared shared;
  host.progress = [&shared](int done, int total, const std::string& what) {
    const std::lock_guard<std::mutex> lock(shared.mutex);
    shared.done = done;
    shared.total = total;
    shared.what = what;
  };
  Worker worker(host, shared, words);
  std::exception_ptr raised;
  for (bool has_ended = false; !has_ended;) {
    int done = 0, total = 0;
    std::string what;
    has_ended = wait(shared, host, done, total, what);
    if (raised) continue;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (total > 0 && !progress.is_none()) progress(done, total, what);
    } catch (...) {
      raised = std::current_exception();
      worker.interrupt();
    }
  }
  worker.join();
  if (raised) std::rethrow_exception(raised);
  if (worker.error) std::rethrow_exception(worker.error);
  py::dict result;
  result["code"] = worker.code;
  result["result"] = host.result.is_null() ? std::string() : files::to_text(host.result);
  result["certificate"] = host.certificate_written;
  result["notes"] = host.notes;
  return result;
}

}  // namespace swarmcert::python
