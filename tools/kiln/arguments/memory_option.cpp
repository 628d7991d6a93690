#include "arguments/memory_option.h"

#include <charconv>
#include <cmath>
#include <cstring>

#include "kiln/kiln.h"

namespace kiln::cli {

std::uint64_t parse_memory(const std::string& text) {
  constexpr const char* kUnits = "KMGT";
  double value = 0;
  const char* const end = text.data() + text.size();
  auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc() && rest + 1 == end && std::strchr(kUnits, *rest) != nullptr) {
    value = std::ldexp(value, 10 * static_cast<int>(std::strchr(kUnits, *rest) - kUnits + 1));
    ++rest;
  }
  if (error != std::errc() || rest != end || !(value >= 0x1p26 && value <= 0x1p60)) {
    throw Error(ErrorCode::usage,
                "--memory-limit: '" + text +
                    "' is no memory limit: give a size from 64M up, such as 500M, 4G or 2T.");
  }
  return static_cast<std::uint64_t>(value);
}

void add_memory_option(Command& app) {
  for (Command* command : app.commands()) {
    command
        ->add_option(
            "--memory-limit",
            [](const Option::Words& words) { set_memory_limit(parse_memory(words.back())); },
            "The most memory to take, such as 4G (default: three quarters of what is free)")
        ->type_name("SIZE")
        ->group("The run");
  }
}

}  // namespace kiln::cli
