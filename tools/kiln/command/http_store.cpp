#include "command/http_store.h"

#include <atomic>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "base/formatted.h"
#include "kiln/error.h"

#ifdef KILN_HAS_CURL
#include <curl/curl.h>
#endif

namespace kiln::cli {

bool is_cache_server(const std::string& cache) {
  return cache.starts_with("http://") || cache.starts_with("https://");
}

#ifdef KILN_HAS_CURL

namespace {

/// Number of failed requests in a row after which the server is no longer used.
constexpr int kMaxFailures = 3;
/// Timeouts in seconds, so that a server that hangs does not block the run: for the connection, and for transfers
/// below one byte per second.
constexpr long kConnectSeconds = 5, kStalledSeconds = 20;
/// Maximum size of a result in bytes.
constexpr std::size_t kMaxResultBytes = std::size_t{4} << 30;

/// Removes the user and the password from a URL, for messages.
std::string without_secret(const std::string& url) {
  const std::size_t host = url.find("//") + 2, at = url.find('@', host), end = url.find('/', host);
  return at == std::string::npos || at > end ? url : url.substr(0, host) + url.substr(at + 1);
}

struct UploadSource {
  std::string_view bytes;
  std::size_t at = 0;
};

std::size_t receive_bytes(char* data, std::size_t, std::size_t count, void* to) {
  std::string& bytes = *static_cast<std::string*>(to);
  if (bytes.size() + count > kMaxResultBytes) return 0;
  bytes.append(data, count);
  return count;
}

std::size_t send_bytes(char* data, std::size_t, std::size_t most, void* from) {
  UploadSource& upload = *static_cast<UploadSource*>(from);
  const std::size_t count = upload.bytes.copy(data, most, upload.at);
  upload.at += count;
  return count;
}

std::size_t discard_received_bytes(char*, std::size_t, std::size_t count, void*) { return count; }

class HttpStore : public CacheStore {
 public:
  HttpStore(std::string url, std::function<void(const std::string&)> warn)
      : url_(std::move(url)), warn_(std::move(warn)) {
    static std::once_flag once;
    std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
    while (url_.ends_with('/')) url_.pop_back();
    CURLU* const parts = curl_url();
    const bool is_valid = curl_url_set(parts, CURLUPART_URL, url_.c_str(), 0) == CURLUE_OK;
    curl_url_cleanup(parts);
    if (!is_valid || url_.find_first_of("?#") != std::string::npos) {
      throw Error(ErrorCode::usage, "--cache '" + without_secret(url_) +
                                        "' is no URL of a folder: give http://HOST:PORT/FOLDER.");
    }
  }
  ~HttpStore() override {
    for (CURL* const handle : idle_handles_) curl_easy_cleanup(handle);
  }

 private:
  std::optional<std::string> load(const std::string& name) override {
    std::string bytes;
    const long answer = call(name, [&](CURL* handle) {
      curl_easy_setopt(handle, CURLOPT_HTTPGET, 1L);
      curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, receive_bytes);
      curl_easy_setopt(handle, CURLOPT_WRITEDATA, &bytes);
    });
    return answer == 200 ? std::optional(std::move(bytes)) : std::nullopt;
  }

  bool store(const std::string& name, std::string_view bytes) override {
    UploadSource upload{bytes};
    const long answer = call(name, [&](CURL* handle) {
      upload.at = 0;
      curl_easy_setopt(handle, CURLOPT_UPLOAD, 1L);
      curl_easy_setopt(handle, CURLOPT_READFUNCTION, send_bytes);
      curl_easy_setopt(handle, CURLOPT_READDATA, &upload);
      curl_easy_setopt(handle, CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(bytes.size()));
      curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, discard_received_bytes);
    });
    return answer >= 200 && answer < 300;
  }

  /// Sends a request. \returns the HTTP status; 0 if there was no answer
  template <typename Prepare>
  long call(const std::string& name, const Prepare& prepare) {
    if (failures_ >= kMaxFailures) return 0;
    CURL* const handle = borrow_handle();
    if (handle == nullptr) return 0;
    std::string reason(CURL_ERROR_SIZE, '\0');
    const std::string url = url_ + "/" + name;
    curl_easy_setopt(handle, CURLOPT_URL, url.c_str());
    curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(handle, CURLOPT_ERRORBUFFER, reason.data());
    curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
    curl_easy_setopt(handle, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(handle, CURLOPT_LOW_SPEED_TIME, kStalledSeconds);
    // Without this, servers that do not support "100 Continue" would cost a second of waiting.
    curl_slist* const headers = curl_slist_append(nullptr, "Expect:");
    curl_easy_setopt(handle, CURLOPT_HTTPHEADER, headers);
    prepare(handle);
    const CURLcode code = curl_easy_perform(handle);
    long answer = 0;
    if (code == CURLE_OK) curl_easy_getinfo(handle, CURLINFO_RESPONSE_CODE, &answer);
    curl_slist_free_all(headers);
    curl_easy_reset(handle);  // Keeps the connection open for further requests
    return_handle(handle);
    const bool succeeded = code == CURLE_OK && ((answer >= 200 && answer < 300) || answer == 404);
    if (succeeded) {
      failures_ = 0;
    } else if (++failures_ == kMaxFailures) {
      reason.resize(reason.find('\0'));
      if (reason.empty())
        reason = code == CURLE_OK ? formatted("it answers %ld", answer) : curl_easy_strerror(code);
      warn_("--cache: '" + without_secret(url_) + "' is not used any more: " + reason +
            ". Further assets are baked.");
    }
    return code == CURLE_OK ? answer : 0;
  }

  CURL* borrow_handle() {
    const std::lock_guard lock(mutex_);
    if (idle_handles_.empty()) return curl_easy_init();
    CURL* const handle = idle_handles_.back();
    idle_handles_.pop_back();
    return handle;
  }

  void return_handle(CURL* handle) {
    const std::lock_guard lock(mutex_);
    idle_handles_.push_back(handle);
  }

  std::string url_;
  std::function<void(const std::string&)> warn_;
  std::atomic<int> failures_{0};
  std::mutex mutex_;
  std::vector<CURL*> idle_handles_;
};

}  // namespace

std::unique_ptr<CacheStore> open_cache_server(const std::string& url,
                                              std::function<void(const std::string&)> warn) {
  return std::make_unique<HttpStore>(url, std::move(warn));
}

#else

std::unique_ptr<CacheStore> open_cache_server(const std::string&,
                                              std::function<void(const std::string&)>) {
  throw Error(ErrorCode::usage,
              "--cache names a server, but this build has no libcurl: give a folder, or build with "
              "libcurl4-openssl-dev.");
}

#endif

}  // namespace kiln::cli
