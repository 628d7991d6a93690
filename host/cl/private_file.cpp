#include "cl/private_file.h"

#include <atomic>
#include <cstddef>
#include <string>

#include "base/file.h"

namespace kiln::ocl {

bool replace_private_file(const std::filesystem::path& file, std::string_view bytes) {
  static std::atomic<unsigned> temporary_count{0};
  os::create_private_folders(file.parent_path());
  const std::filesystem::path temporary = file.string() + "." + std::to_string(os::process_id()) +
                                          "." + std::to_string(temporary_count++);
  const int created = os::create_file(temporary, 0600);
  const bool is_written = created >= 0 && os::write_some(created, bytes.data(), bytes.size()) ==
                                              static_cast<std::ptrdiff_t>(bytes.size());
  if (created >= 0) os::close(created);
  if (is_written && os::replace(temporary, file)) return true;
  os::remove_file(temporary.c_str());
  return false;
}

}  // namespace kiln::ocl
