// A job file, and after an empty line that begins with a byte of 1 a path and a pattern. What is read is a job file, or
// kiln::Error(usage); patterns match or do not.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "batch/job_file.h"
#include "batch/path_pattern.h"
#include "kiln/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = text.find("\n\x01");
  try {
    kiln::parse_job_file(text.substr(0, end), "job.toml", "ci");
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::usage) std::abort();
  }
  if (end == std::string_view::npos) return 0;
  const std::string_view rest = text.substr(end + 2);
  const std::size_t line = rest.find('\n');
  if (line == std::string_view::npos) return 0;
  try {
    const kiln::PathPattern pattern(rest.substr(line + 1));
    kiln::Captures captures;
    if (pattern.matches(rest.substr(0, line), {}, captures)) {
      // What was captured leads back to a path that matches.
      const kiln::PathPattern filled = pattern.substitute(captures);
      if (filled.is_plain() && !filled.matches(filled.path({}), {}, captures)) std::abort();
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::usage) std::abort();
  }
  return 0;
}
