// Files that lie: bytes written by hand, and what reading them must come to.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "io/file/byte_source.h"
#include "kiln/error.h"

namespace kiln::test {

inline std::string little_endian(std::uint64_t value, int count) {
  std::string bytes;
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

inline std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int i = 3; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

/// The message of the Error(input) that reading must end with: names the file, gives a remedy, and
/// blames no option.
inline std::string refusal(const std::string& bytes,
                           const std::function<void(const ByteSource&)>& read) {
  const auto source = bytes_in_memory(bytes);
  try {
    read(*source);
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_EQ(error.code(), ErrorCode::input) << text;
    EXPECT_NE(text.find("hostile"), std::string::npos) << text;
    EXPECT_EQ(text.find("--size"), std::string::npos) << text;
    EXPECT_TRUE(text.ends_with(".")) << text;
    return text;
  }
  ADD_FAILURE() << "was read";
  return {};
}

inline void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    EXPECT_NE(text.find(word), std::string::npos) << "no \"" << word << "\" in: " << text;
  }
}

/// While it lives, the process may take 1 GiB of addresses more than it has, enough for OpenEXR's threads.
/// Nothing under AddressSanitizer, which takes terabytes.
class AddressLimit {
 public:
  AddressLimit() {
#ifndef __SANITIZE_ADDRESS__
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    if (pages == 0 || getrlimit(RLIMIT_AS, &before_) != 0) return;
    rlimit limit = before_;
    limit.rlim_cur = pages * 4096 + (std::uint64_t{1} << 30);
    set_ = limit.rlim_cur < before_.rlim_cur && setrlimit(RLIMIT_AS, &limit) == 0;
#endif
  }
  ~AddressLimit() {
    if (set_) setrlimit(RLIMIT_AS, &before_);
  }
  AddressLimit(const AddressLimit&) = delete;
  AddressLimit& operator=(const AddressLimit&) = delete;

 private:
  rlimit before_{};
  bool set_ = false;
};

/// Most memory the process ever had resident, bytes.
inline std::uint64_t peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace kiln::test
