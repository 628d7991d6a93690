#include "cl/kernel_folder.h"

#include <cstdlib>
#include <mutex>
#include <string>

#include "base/file.h"

namespace kiln::ocl {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPoclVariable = "POCL_CACHE_DIR";

std::string environment_text(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

/// Returns the folder that an environment variable names, as an absolute path without ".", and replaces the variable's
/// value by it: PoCL does not start if POCL_CACHE_DIR is ".", and a relative path would name another folder when the
/// current folder changes. Links and ".." stay in the path, so that os::find_unsafe_level() checks them.
std::string folder_of_variable(const char* name) {
  const std::string given = environment_text(name);
  std::error_code error;
  if (given.empty()) return given;
  fs::path folder;
  for (const fs::path& part : os::absolute(given, error)) {
    if (!part.empty() && part != ".") folder /= part;
  }
  if (error || folder == fs::path(given)) return given;
  os::set_environment_variable(name, folder.string().c_str());
  return folder.string();
}

fs::path find_unsafe_level(const fs::path& a, const fs::path& b) {
  const fs::path level = os::find_unsafe_level(a);
  return level.empty() ? os::find_unsafe_level(b) : level;
}

/// \param next_action what the user should do, or what Kiln does instead
Warning make_warning(const fs::path& level, const std::string& next_action) {
  return {"kernel-folder",
          "Compiled kernels are code, and another user owns '" + level.string() +
              "' or may write to it: " + next_action,
          1};
}

/// True if the process may write to a folder, or may create it.
bool can_write(fs::path folder) {
  while (!os::query_link(folder) && folder.has_parent_path() && folder != folder.parent_path()) {
    folder = folder.parent_path();
  }
  return os::may_write_in(folder);
}

/// Sets the environment variable to the user's folder. \throws Error(device)
fs::path use_user_folder() {
  const fs::path folder = os::user_folder();
  os::create_private_folders(folder);
  const fs::path level = find_unsafe_level(folder, folder / "kiln");
  if (!level.empty()) {
    throw Error(ErrorCode::device,
                "Compiled kernels are code, and there is no safe folder for them: another user "
                "owns '" +
                    level.string() +
                    "' or may write to it. Remove it, or set POCL_CACHE_DIR or HOME to a folder "
                    "that is yours alone.",
                "kernel-folder");
  }
  if (!os::may_write_in(folder)) {
    throw Error(ErrorCode::device,
                "Compiled kernels need a folder that can be written, and '" + folder.string() +
                    "' is none. Set POCL_CACHE_DIR or TMPDIR to one, or give the container one at "
                    "/tmp (--tmpfs /tmp:exec).",
                "kernel-folder");
  }
  os::set_environment_variable(kPoclVariable, folder.string().c_str());
  return folder;
}

/// Copies those files of a folder that do not exist in the other folder. Files that cannot be read or written are
/// skipped; their kernels are compiled again.
void copy_missing_files(const fs::path& from, const fs::path& to) {
  const std::string suffix = "." + std::to_string(os::process_id());
  std::error_code failed;
  const auto skip = fs::directory_options::skip_permission_denied;
  for (fs::recursive_directory_iterator at(from, skip, failed), end; !failed && at != end;
       at.increment(failed)) {
    std::error_code ignored_error;
    const fs::path place = to / at->path().lexically_relative(from);
    if (!at->is_regular_file(ignored_error) || fs::exists(place, ignored_error)) continue;
    os::create_private_folders(place.parent_path());
    // A file gets its name when it is complete, since other processes may read the folder meanwhile.
    const fs::path temporary = place.string() + suffix;
    if (!fs::copy_file(at->path(), temporary, ignored_error) || !os::replace(temporary, place)) {
      os::remove_file(temporary.c_str());
    }
  }
}

/// Handles a folder of kernels that this process may not write to, such as one in a container image. PoCL writes to
/// its cache even if it contains all kernels, and ends the process if writing fails. So the kernels are copied to the
/// user's folder, which takes milliseconds.
KernelFolder copy_to_user_folder(const fs::path& given) {
  const fs::path level = find_unsafe_level(given, given / "kiln"), folder = use_user_folder();
  if (level.empty()) {
    copy_missing_files(given, folder);
    return {folder / "kiln"};
  }
  return {folder / "kiln",
          {make_warning(level, "they are not used, but compiled again, in '" + folder.string() +
                                   "'. Let root own that folder, and nobody else write to it.")}};
}

}  // namespace

KernelFolder kernel_folder() {
  static std::mutex mutex;
  static std::string chosen_folder;  // the folder of compiled kernels that this process has chosen
  static std::vector<Warning> warnings_of_choice;
  const std::lock_guard lock(mutex);
  if (const std::string given_folder = folder_of_variable(kPoclVariable); !given_folder.empty()) {
    const fs::path kiln = fs::path(given_folder) / "kiln";
    if (given_folder == chosen_folder) return {kiln, warnings_of_choice};
    os::create_private_folders(given_folder);
    if (!os::may_write_in(given_folder)) {
      KernelFolder copy = copy_to_user_folder(given_folder);
      chosen_folder = copy.kiln.parent_path().string();
      warnings_of_choice = copy.warnings;
      return copy;
    }
    const fs::path level = find_unsafe_level(given_folder, kiln);
    if (level.empty()) return {kiln};
    return {kiln, {make_warning(level, "set POCL_CACHE_DIR to a folder that is yours alone.")}};
  }
  std::vector<Warning> warnings;
  const std::string given_folder = folder_of_variable("XDG_CACHE_HOME"),
                    home = environment_text("HOME");
  const fs::path caches = !given_folder.empty() ? fs::path(given_folder)
                          : home.empty()        ? fs::path()
                                                : fs::path(home) / ".cache";
  if (!caches.empty() && can_write(caches)) {
    const char* const pocl = environment_text("POCL_KERNEL_CACHE") == "0" ? "uncached" : "kcache";
    const fs::path kiln = caches / "kiln", level = find_unsafe_level(caches / "pocl" / pocl, kiln);
    if (level.empty() || !given_folder.empty()) {
      if (!level.empty()) {
        warnings.push_back(
            make_warning(level,
                         "set XDG_CACHE_HOME or POCL_CACHE_DIR to a folder that is yours "
                         "alone."));
      }
      // with an empty value, PoCL would end the process
      os::set_environment_variable(kPoclVariable, nullptr);
      return {kiln, warnings};
    }
    warnings.push_back(
        make_warning(level, "they are kept in '" + os::user_folder().string() +
                                "'. Remove this permission (chmod go-w), or set POCL_CACHE_DIR."));
  }
  const fs::path folder = use_user_folder();
  chosen_folder = folder.string();
  warnings_of_choice = warnings;
  return {folder / "kiln", warnings};
}

}  // namespace kiln::ocl
