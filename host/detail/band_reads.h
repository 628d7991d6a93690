// Downloads device arrays that several maps of a bake read: arrays of the band once per band, and
// arrays of the high poly once per bake.
#pragma once

#include <cstdint>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "cl/context.h"
#include "detail/shared_result.h"

namespace kiln {

/// Host copies of device arrays. They stay valid for one band, or for one state of the high poly.
/// Not thread-safe.
class BandReads : public SharedWork {
 public:
  explicit BandReads(cl::Context& context) : context_(context) {}

  /// Discards what read() has downloaded.
  void next_band() override { band_ = {}; }
  /// Discards what read_source() has downloaded, too.
  void next_source() override {
    next_band();
    source_ = {};
    ++source_version_;
  }
  /// A number that every call of next_source() changes. Caches of data about the high poly store
  /// it, and are out of date if it differs.
  std::uint64_t source_version() const { return source_version_; }

  /// Elements `offset` to `offset` + `count` - 1 of an array of the band. The first call downloads
  /// them.
  template <typename T>
  const std::vector<T>& read(const cl::Array<T>& array, std::size_t count, std::size_t offset = 0) {
    return cached_download(band_, array, count, offset);
  }
  /// All elements of an array of the high poly. The first call downloads them.
  template <typename T>
  const std::vector<T>& read_source(const cl::Array<T>& array) {
    return cached_download(source_, array, array.size(), 0);
  }

 private:
  /// Downloaded elements, by device array and offset.
  template <typename T>
  using DownloadsByArray = std::map<std::pair<const void*, std::size_t>, std::vector<T>>;
  using DownloadCache = std::tuple<DownloadsByArray<std::uint32_t>, DownloadsByArray<float>,
                                   DownloadsByArray<std::uint8_t>>;

  template <typename T>
  const std::vector<T>& cached_download(DownloadCache& cache, const cl::Array<T>& array,
                                        std::size_t count, std::size_t offset) {
    std::vector<T>& values = std::get<DownloadsByArray<T>>(cache)[{&array, offset}];
    if (values.size() < count) {
      values.resize(count);
      array.read(context_, values, offset);
    }
    return values;
  }

  cl::Context& context_;
  DownloadCache band_, source_;
  std::uint64_t source_version_ = 0;
};

}  // namespace kiln
