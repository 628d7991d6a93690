#include "base/process.h"

#include <cerrno>
#include <cwchar>

#include "base/windows/api.h"
// This header must follow the API's header, whose types it uses.
#include <shellapi.h>

namespace kiln::os {

namespace fs = std::filesystem;

void read_arguments(int& argc, char**& argv) {
  static std::vector<std::string> words;
  static std::vector<char*> pointers;
  words = own_arguments();
  if (words.empty()) return;
  pointers.clear();
  for (std::string& word : words) pointers.push_back(word.data());
  argc = static_cast<int>(pointers.size());
  pointers.push_back(nullptr);
  argv = pointers.data();
}

std::vector<std::string> own_arguments() {
  std::vector<std::string> words;
  int count = 0;
  wchar_t** const wide = CommandLineToArgvW(GetCommandLineW(), &count);
  if (wide == nullptr) return words;
  for (int i = 0; i < count; ++i) words.push_back(to_utf8(wide[i]));
  LocalFree(wide);
  return words;
}

fs::path own_program() {
  constexpr std::size_t kMaxLength = 32768;  // maximum length of a path
  std::wstring path(kMaxLength, L'\0');
  path.resize(GetModuleFileNameW(nullptr, path.data(), kMaxLength));
  return path;
}

void own_folder(std::span<char> to) noexcept {
  const std::string folder = (own_program().parent_path() / "").string();
  to[folder.size() < to.size() ? folder.copy(to.data(), to.size()) : 0] = '\0';
}
std::vector<fs::path> programs_of_path(const std::string& /*name*/, const std::string& /*unset*/) {
  return {};
}
int become_program(const char* /*program*/, char** /*argv*/) noexcept { return ENOSYS; }

namespace {

/// Quotes a word for CommandLineToArgvW(), which halves backslashes only before a quotation mark.
std::wstring quote_argument(const std::wstring& word) {
  std::wstring text = L"\"";
  std::size_t backslash_count = 0;
  for (const wchar_t c : word) {
    if (c == L'"') text.append(backslash_count + 1, L'\\');
    backslash_count = c == L'\\' ? backslash_count + 1 : 0;
    text += c;
  }
  return text.append(backslash_count, L'\\') + L'"';
}

}  // namespace

bool run_own_program(const std::vector<std::string>& words,
                     const std::function<bool()>& /*interrupted*/) {
  std::wstring line;
  for (const std::string& word : words)
    line += (line.empty() ? L"" : L" ") + quote_argument(to_wide(word));
  STARTUPINFOW startup_information{};
  startup_information.cb = sizeof startup_information;
  PROCESS_INFORMATION process_information{};
  if (CreateProcessW(own_program().c_str(), line.data(), nullptr, nullptr, TRUE, 0, nullptr,
                     nullptr, &startup_information, &process_information) == FALSE) {
    return false;
  }
  CloseHandle(process_information.hThread);
  // Windows sends Ctrl-C to all processes of a console, so it need not be forwarded to the program.
  WaitForSingleObject(process_information.hProcess, INFINITE);
  CloseHandle(process_information.hProcess);
  return true;
}

void* load_library(const std::string& path, std::string& reason) {
  const HMODULE library = LoadLibraryW(to_wide(path).c_str());
  if (library == nullptr) {
    reason =
        "'" + path + "' does not load (error " + std::to_string(GetLastError()) + " of Windows)";
  }
  return reinterpret_cast<void*>(library);
}

void* find_library_function(void* library, const char* name) noexcept {
  return reinterpret_cast<void*>(GetProcAddress(reinterpret_cast<HMODULE>(library), name));
}

bool can_restart() noexcept { return false; }
void prepare_restart(char** /*argv*/, const std::string& /*variable*/) {}
void restart() noexcept {}
SplitEnd split_process() { return {}; }

}  // namespace kiln::os
