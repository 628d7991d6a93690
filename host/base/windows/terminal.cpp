#include "base/terminal.h"

#include <fcntl.h>
#include <io.h>

#include <cstdlib>
#include <cstring>

#include "base/windows/api.h"

namespace kiln::os {
namespace {

HANDLE handle_of(std::FILE* stream) noexcept {
  const int file = _fileno(stream);
  return file < 0 ? INVALID_HANDLE_VALUE : reinterpret_cast<HANDLE>(_get_osfhandle(file));
}

// previous code pages of the console, which outlives the program
UINT output_page = 0, input_page = 0;
void restore_console() {
  if (output_page == 0) return;
  SetConsoleOutputCP(output_page);
  SetConsoleCP(input_page);
}

}  // namespace

void prepare_streams() noexcept {
  for (std::FILE* stream : {stdin, stdout, stderr}) {
    if (_fileno(stream) >= 0) _setmode(_fileno(stream), _O_BINARY);
  }
  for (std::FILE* stream : {stdout, stderr}) {
    DWORD mode = 0;
    if (GetConsoleMode(handle_of(stream), &mode) == FALSE) continue;
    SetConsoleMode(handle_of(stream),
                   mode | ENABLE_PROCESSED_OUTPUT | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
    if (output_page != 0) continue;
    output_page = GetConsoleOutputCP();
    input_page = GetConsoleCP();
    SetConsoleOutputCP(CP_UTF8);
    SetConsoleCP(CP_UTF8);
    std::atexit(restore_console);
  }
}

void end_process(int exit_code) noexcept {
  restore_console();
  std::_Exit(exit_code);
}

bool reserve_streams() noexcept {
  for (int descriptor = 0; descriptor <= 2; ++descriptor) {
    if (_get_osfhandle(descriptor) != -1) continue;
    // _wopen() returns the lowest free descriptor.
    if (_wopen(L"NUL", descriptor == 0 ? _O_WRONLY : _O_RDONLY) != descriptor) return false;
  }
  return true;
}

bool is_terminal(std::FILE* stream) noexcept {
  DWORD mode = 0;
  return GetConsoleMode(handle_of(stream), &mode) != FALSE &&
         (mode & ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

std::size_t terminal_columns() noexcept {
  CONSOLE_SCREEN_BUFFER_INFO info{};
  constexpr std::size_t kDefaultColumns = 80;
  if (GetConsoleScreenBufferInfo(handle_of(stderr), &info) == FALSE) return kDefaultColumns;
  const int column_count = info.srWindow.Right - info.srWindow.Left + 1;
  return column_count > 0 ? static_cast<std::size_t>(column_count) : kDefaultColumns;
}

bool has_reader_closed(std::FILE* stream) noexcept {
  // Writing to a pipe only fails if it has no reader.
  return GetFileType(handle_of(stream)) == FILE_TYPE_PIPE;
}

bool is_closed(std::FILE* stream) noexcept {
  return GetFileType(handle_of(stream)) == FILE_TYPE_UNKNOWN;
}

void write_error(const char* text) noexcept {
  DWORD written_bytes = 0;
  WriteFile(GetStdHandle(STD_ERROR_HANDLE), text, static_cast<DWORD>(std::strlen(text)),
            &written_bytes, nullptr);
}

}  // namespace kiln::os
