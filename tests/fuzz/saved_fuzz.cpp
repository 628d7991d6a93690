// Saved sources with right hashes: the first byte chooses between a mesh and a search structure.
#include <cstring>
#include <string>
#include <vector>

#include "base/byte_hash.h"
#include "mesh_fuzz.h"
#include "source/saved_tree.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kiln;
  if (size == 0) return 0;
  const std::string body(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] % 2 == 0) {
    std::string file = "kilnsrc1";
    const auto put = [&](const auto& value) {
      file.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    put(std::uint32_t{0x01020304});
    put(std::uint32_t{0});
    put(std::uint64_t{body.size()});
    put(hash_bytes(body));
    file += body;
    return test::fuzz_mesh(reinterpret_cast<const std::uint8_t*>(file.data()), file.size(),
                           MeshFormat::saved);
  }
  std::vector<kiln_bvh_node> nodes(body.size() / sizeof(kiln_bvh_node));
  if (!nodes.empty()) std::memcpy(nodes.data(), body.data(), nodes.size() * sizeof nodes[0]);
  tree_problem(nodes, std::vector<kiln_bvh_block>(2), data[0] % 4 == 1, 3);
  return 0;
}
