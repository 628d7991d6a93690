// Uses an HTTP server as the cache of `kiln run`, by GET and PUT requests.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "batch/cache_store.h"

namespace kiln::cli {

/// True if the value of --cache is a URL: "http://" or "https://".
bool is_cache_server(const std::string& cache);

/// Opens a cache that stores results at URL/NAME. Status 404 means that a result is missing. After three failed
/// requests in a row, the server is not used for the rest of the run: a missing cache never fails a run.
/// \param warn  called once, from any thread, with the reason why the server is no longer used
/// \throws Error(usage) for an invalid URL, and in builds without libcurl
std::unique_ptr<CacheStore> open_cache_server(const std::string& url,
                                              std::function<void(const std::string&)> warn);

}  // namespace kiln::cli
