// A library to load before a program (LD_PRELOAD): it begins as programs with windows do, in the locale that the
// environment names. Kiln is a library, so files and maps are the same there.
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <locale>

__attribute__((constructor)) static void begin_in_locale() {
  if (std::setlocale(LC_ALL, "") == nullptr) {
    std::fputs("program_locale: there is no locale as LC_ALL names it.\n", stderr);
    std::abort();
  }
  std::locale::global(std::locale(""));
}
