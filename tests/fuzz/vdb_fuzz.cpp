// The check of an OpenVDB file's frame: the file fits, or kiln::Error. OpenVDB itself is not run.
#include <cstdint>
#include <cstdlib>

#include "io/volume/volume_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto source = kiln::bytes_in_memory({reinterpret_cast<const char*>(data), size});
  const kiln::VolumeInput input{"input", source.get(), nullptr, {}};
  try {
    kiln::check_openvdb_frame(input);
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}
