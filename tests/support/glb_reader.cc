#include "tests/support/glb_reader.h"

#include <meshoptimizer.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

namespace scarp::test {
namespace {

using nlohmann::json;

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("glb: " + what);
}

std::uint32_t word_at(const std::string& bytes, std::size_t offset) {
  if (offset + 4 > bytes.size()) fail("ends early");
  std::uint32_t word;
  std::memcpy(&word, bytes.data() + offset, 4);
  return word;
}

template <class T>
std::vector<T> as_vector(const std::string& bytes) {
  if (bytes.size() % sizeof(T) != 0) fail("a view of odd length");
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

class Reader {
 public:
  explicit Reader(const std::string& bytes) {
    if (word_at(bytes, 0) != 0x46546C67 || word_at(bytes, 4) != 2) fail("no glTF 2");
    if (word_at(bytes, 8) != bytes.size()) fail("not as long as it says");
    const std::size_t length = word_at(bytes, 12);
    if (word_at(bytes, 16) != 0x4E4F534A || length % 4 != 0) fail("no JSON chunk");
    json_ = json::parse(bytes.substr(20, length));
    const std::size_t binary = 20 + length;
    if (word_at(bytes, binary + 4) != 0x004E4942) fail("no binary chunk");
    if (binary + 8 + word_at(bytes, binary) != bytes.size()) fail("chunks do not fill the file");
    binary_ = bytes.substr(binary + 8);
    if (json_.at("buffers")[0].at("byteLength") != binary_.size()) fail("buffer of another length");
  }

  ReadGlb read() {
    ReadGlb glb;
    const json& node = json_.at("nodes")[0];
    const auto t = node.at("translation").get<std::array<double, 3>>();
    glb.translation = {t[0], -t[2], t[1]};
    const json& primitive = json_.at("meshes")[0].at("primitives")[0];
    const json& attributes = primitive.at("attributes");
    for (const auto& v : as_vector<std::array<float, 3>>(accessor(attributes.at("POSITION"), 5126)))
      glb.positions.push_back({v[0], -v[2], v[1]});
    read_normals(attributes.at("NORMAL"), glb);
    if (attributes.contains("_FEATURE_ID_0")) {
      glb.features = as_vector<float>(accessor(attributes.at("_FEATURE_ID_0"), 5126));
      const json& feature = primitive.at("extensions").at("EXT_mesh_features").at("featureIds")[0];
      glb.null_feature = feature.at("nullFeatureId").get<std::uint32_t>();
    }
    const json& indices = json_.at("accessors")[primitive.at("indices").get<std::size_t>()];
    const std::string bytes = view(indices.at("bufferView"));
    if (indices.at("componentType") == 5123)
      for (const std::uint16_t i : as_vector<std::uint16_t>(bytes)) glb.corners.push_back(i);
    else
      glb.corners = as_vector<std::uint32_t>(bytes);
    if (glb.corners.size() != indices.at("count")) fail("indices of another count");
    if (json_.contains("extensions")) read_table(glb);
    glb.is_compressed = json_.at("buffers").size() == 2;
    return glb;
  }

 private:
  std::string accessor(const json& index, int component) {
    const json& accessor = json_.at("accessors")[index.get<std::size_t>()];
    if (accessor.at("componentType") != component) fail("a component of another type");
    return view(accessor.at("bufferView"));
  }

  std::string view(const json& index) {
    const json& view = json_.at("bufferViews")[index.get<std::size_t>()];
    if (!view.contains("extensions"))
      return binary_.substr(view.value("byteOffset", std::size_t{0}), view.at("byteLength"));
    const json& coded = view.at("extensions").at("EXT_meshopt_compression");
    const std::size_t count = coded.at("count"), stride = coded.at("byteStride");
    const std::string bytes = binary_.substr(coded.at("byteOffset"), coded.at("byteLength"));
    std::string out(count * stride, '\0');
    const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
    const bool is_indices = coded.at("mode") == "TRIANGLES";
    const int failed =
        is_indices ? meshopt_decodeIndexBuffer(out.data(), count, stride, data, bytes.size())
                   : meshopt_decodeVertexBuffer(out.data(), count, stride, data, bytes.size());
    if (failed != 0) fail("compressed bytes that do not decode");
    if (coded.value("filter", "") == "OCTAHEDRAL")
      meshopt_decodeFilterOct(out.data(), count, stride);
    if (view.at("byteLength") != out.size()) fail("a decoded view of another length");
    return out;
  }

  void read_normals(const json& index, ReadGlb& glb) {
    const json& accessor_json = json_.at("accessors")[index.get<std::size_t>()];
    if (accessor_json.at("componentType") == 5120) {
      for (const auto& v : as_vector<std::array<std::int8_t, 4>>(accessor(index, 5120)))
        glb.normals.push_back({static_cast<float>(v[0]) / 127.0F,
                               -static_cast<float>(v[2]) / 127.0F,
                               static_cast<float>(v[1]) / 127.0F});
      return;
    }
    for (const auto& v : as_vector<std::array<float, 3>>(accessor(index, 5126)))
      glb.normals.push_back({v[0], -v[2], v[1]});
  }

  void read_table(ReadGlb& glb) {
    const json& table =
        json_.at("extensions").at("EXT_structural_metadata").at("propertyTables")[0];
    const auto values = [&](const char* name) {
      return view(table.at("properties").at(name).at("values"));
    };
    glb.group = as_vector<std::uint32_t>(values("group"));
    glb.triangles = as_vector<std::uint32_t>(values("triangles"));
    glb.first_triangle = as_vector<std::uint32_t>(values("firstTriangle"));
    glb.minimum_height_m = as_vector<double>(values("minimumHeight"));
    glb.maximum_height_m = as_vector<double>(values("maximumHeight"));
    glb.region_rad = as_vector<std::array<double, 4>>(values("region"));
    if (glb.group.size() != table.at("count")) fail("a table of another count");
  }

  json json_;
  std::string binary_;
};

}  // namespace

ReadGlb read_glb(const std::string& bytes) {
  return Reader(bytes).read();
}

ReadGlb read_glb_file(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return read_glb(bytes.str());
}

}  // namespace scarp::test
