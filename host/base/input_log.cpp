#include "base/input_log.h"

#include <algorithm>
#include <atomic>
#include <system_error>
#include <vector>

#include "base/file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::mutex all_logs_mutex;
std::vector<InputLog*> all_logs;
std::atomic<int> log_count{0};
thread_local InputLog* own_log = nullptr;

std::string absolute_text(const fs::path& path) {
  std::error_code error;
  const fs::path full_path = os::absolute(path, error);
  return os::normal(error ? path : full_path).string();
}

/// Calls a function for the calling thread's log, or for all logs if the thread has none.
template <typename Function>
void for_each_log(const Function& function) {
  if (own_log != nullptr) {
    function(*own_log);
    return;
  }
  const std::lock_guard lock(all_logs_mutex);
  for (InputLog* const log : all_logs) function(*log);
}

}  // namespace

InputLog::InputLog(std::function<std::string(const fs::path&)> identify)
    : identify_(std::move(identify)) {
  const std::lock_guard lock(all_logs_mutex);
  all_logs.push_back(this);
  ++log_count;
}

InputLog::~InputLog() {
  const std::lock_guard lock(all_logs_mutex);
  std::erase(all_logs, this);
  --log_count;
}

InputLog::Inputs InputLog::inputs() const {
  const std::lock_guard lock(mutex_);
  return inputs_;
}

void InputLog::add(const fs::path& path) {
  const std::string full_path = absolute_text(path);
  {
    const std::lock_guard lock(mutex_);
    if (inputs_.files.count(full_path) != 0) return;
  }
  // The identity is determined before the caller reads the file: if the file changes later, the recorded identity
  // differs from the new one.
  std::string identity = identify_(full_path);
  const std::lock_guard lock(mutex_);
  inputs_.files.try_emplace(full_path, std::move(identity));
}

InputLogScope::InputLogScope(InputLog* log) noexcept : before_(own_log) { own_log = log; }
InputLogScope::~InputLogScope() { own_log = before_; }
InputLog* current_input_log() noexcept { return own_log; }

void register_input(const fs::path& path) {
  if (log_count == 0) return;
  for_each_log([&](InputLog& log) { log.add(path); });
}

void register_missing_file(const fs::path& path) {
  if (log_count == 0) return;
  for_each_log([&](InputLog& log) {
    const std::lock_guard lock(log.mutex_);
    log.inputs_.missing_files.insert(absolute_text(path));
  });
}

void register_query(const fs::path& path, const std::string& question, const std::string& answer) {
  if (log_count == 0) return;
  for_each_log([&](InputLog& log) {
    const std::lock_guard lock(log.mutex_);
    log.inputs_.answers[{absolute_text(path), question}] = answer;
  });
}

bool register_file_check(const fs::path& path) {
  std::error_code error;
  const bool is_present = fs::is_regular_file(path, error);
  is_present ? register_input(path) : register_missing_file(path);
  return is_present;
}

}  // namespace kiln
