// A cache of kiln run on a server, by plain GET and PUT.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "batch/cache_store.h"

namespace kiln::cli {

/// True if a --cache names a server: "http://" or "https://".
bool is_cache_server(const std::string& cache);

/// Results at URL/NAME. 404 is a result that is not there. A server that cannot be reached, or answers with errors, is
/// left alone for the rest of the run after a few calls in a row: a run never fails for want of a cache.
/// \param warn  is told once why the server is left alone; any thread
/// \throws Error(usage) for what is no URL, and where this build has no libcurl
std::unique_ptr<CacheStore> open_cache_server(const std::string& url,
                                              std::function<void(const std::string&)> warn);

}  // namespace kiln::cli
