// interrupt MILLISECONDS PROGRAM WORD...: runs a program of this console, presses Ctrl-C after so long, and ends with the
// program's exit code. A program that has ended before gives 200, one that Ctrl-C does not end within a minute 201.
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>

#include <cstdio>
#include <cstdlib>
#include <string>

int wmain(int argc, wchar_t** argv) {
  constexpr int kEndedBefore = 200, kNeverEnded = 201, kNotStarted = 202;
  if (argc < 3) return kNotStarted;
  std::wstring line;
  for (int i = 2; i < argc; ++i) line += L"\"" + std::wstring(argv[i]) + L"\" ";
  STARTUPINFOW startup{};
  startup.cb = sizeof startup;
  PROCESS_INFORMATION started{};
  if (GetConsoleWindow() == nullptr) AllocConsole();
  // Of this program alone: the one that is started must not inherit it.
  if (CreateProcessW(nullptr, line.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr, &startup,
                     &started) == FALSE) {
    return kNotStarted;
  }
  SetConsoleCtrlHandler(nullptr, TRUE);
  if (WaitForSingleObject(started.hProcess, static_cast<DWORD>(_wtoi(argv[1]))) == WAIT_OBJECT_0)
    return kEndedBefore;
  if (GenerateConsoleCtrlEvent(CTRL_C_EVENT, 0) == FALSE) {
    std::fprintf(stderr, "no event: %lu\n", GetLastError());
    TerminateProcess(started.hProcess, kNotStarted);
  }
  constexpr DWORD kMinute = 60000;
  if (WaitForSingleObject(started.hProcess, kMinute) != WAIT_OBJECT_0) {
    TerminateProcess(started.hProcess, kNeverEnded);
    return kNeverEnded;
  }
  DWORD code = 0;
  GetExitCodeProcess(started.hProcess, &code);
  return static_cast<int>(code);
}
