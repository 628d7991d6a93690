#include "base/terminal.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string_view>

namespace kiln::os {

void prepare_streams() noexcept {}
void end_process(int exit_code) noexcept { std::_Exit(exit_code); }

bool reserve_streams() noexcept {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    if (fcntl(descriptor, F_GETFD) >= 0) continue;
    // open() returns the lowest free descriptor.
    if (open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY) != descriptor)
      return false;
  }
  return true;
}

bool is_terminal(std::FILE* stream) noexcept {
  if (isatty(fileno(stream)) == 0) return false;
  // Without TERM, the terminal's capabilities are unknown.
  const char* kind = std::getenv("TERM");
  return kind != nullptr && *kind != '\0' && std::string_view(kind) != "dumb";
}

std::size_t terminal_columns() noexcept {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

bool has_reader_closed(std::FILE* stream) noexcept {
  pollfd poll_state{fileno(stream), POLLOUT, 0};
  return poll(&poll_state, 1, 0) == 1 && (poll_state.revents & (POLLERR | POLLHUP)) != 0;
}

bool is_closed(std::FILE* stream) noexcept {
  const int mode = fcntl(fileno(stream), F_GETFL);
  return mode < 0 || (mode & O_ACCMODE) == O_RDONLY;
}

void write_error(const char* text) noexcept {
  [[maybe_unused]] const auto ignored = write(STDERR_FILENO, text, std::strlen(text));
}

}  // namespace kiln::os
