// The words of --transfer: a file, a name that a map may have and a colour space, or kiln::Error(usage).
#include <cstdint>
#include <cstdlib>
#include <string>

#include "job/transfers.h"

namespace {

bool may_name_a_map(const std::string& name) {
  const std::string letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
  return !name.empty() && letters.find(name[0]) != std::string::npos &&
         name.find_first_not_of(letters + "_0123456789") == std::string::npos;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (text.find('\0') != std::string::npos) return 0;  // no argument has it
  try {
    const kiln::TransferArgument transfer = kiln::parse_transfer(text);
    if (!may_name_a_map(transfer.name) || !text.starts_with(transfer.file)) std::abort();
    if (transfer.materials() && !kiln::Words(kiln::kMaterialSlots).contains(transfer.name)) {
      std::abort();
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::usage) std::abort();
  }
  return 0;
}
