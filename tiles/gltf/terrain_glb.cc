#include "tiles/gltf/terrain_glb.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

#include "tiles/gltf/glb.h"
#include "tiles/tileset/metadata_schema.h"

namespace scarp {
namespace {

using json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kByte = 5120, kUnsignedInt = 5125, kUnsignedShort = 5123;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

constexpr std::size_t kMostShortVertices = 65'535;  // the last number restarts a primitive

/// Vector as glTF has it, y up.
std::array<float, 3> y_up(const std::array<float, 3>& v) {
  return {v[0], v[2], -v[1]};
}

/// Builds the asset. With compression the buffer views of the mesh lie in a second buffer that is
/// not there, and say where their compressed bytes are in the first.
class TerrainGlb {
 public:
  TerrainGlb(const TerrainMesh& mesh, GlbCompression compression)
      : mesh_(mesh), compress_(compression == GlbCompression::kMeshopt) {
    assert(!mesh.corners.empty() && mesh.corners.size() % 3 == 0);
    assert(mesh.normals.size() == mesh.positions.size());
    assert(mesh.row_of_vertex.empty() || mesh.row_of_vertex.size() == mesh.positions.size());
    assert(mesh.groups.size() < (1U << 24));
  }

  std::vector<std::byte> bytes() {
    json& out = parts_.json;
    out["asset"] = {{"version", "2.0"}, {"generator", "scarp " SCARP_VERSION}};
    if (compress_) {
      out["extensionsUsed"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
      out["extensionsRequired"] = out["extensionsUsed"];
    }
    out["scene"] = 0;
    out["scenes"] = {{{"nodes", {0}}}};
    const auto& at = mesh_.origin_m;
    out["nodes"] = {{{"mesh", 0}, {"translation", {at[0], at[2], -at[1]}}}};
    json primitive;
    primitive["attributes"]["POSITION"] = add_positions();
    primitive["attributes"]["NORMAL"] = compress_ ? add_byte_normals() : add_normals();
    if (!mesh_.row_of_vertex.empty()) add_features(primitive);
    primitive["indices"] = add_indices();
    primitive["material"] = 0;
    out["meshes"] = {{{"primitives", json::array({primitive})}}};
    out["materials"] = {{{"pbrMetallicRoughness",
                          {{"baseColorFactor", {0.72, 0.70, 0.62, 1.0}},
                           {"metallicFactor", 0.0},
                           {"roughnessFactor", 1.0}}}}};
    if (!mesh_.groups.empty()) add_property_table();
    out["accessors"] = accessors_;
    out["bufferViews"] = views_;
    out["buffers"] = json::array({json::object()});
    if (compress_)
      out["buffers"].push_back(
          {{"byteLength", decoded_bytes_},
           {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
    return glb_bytes(std::move(parts_));
  }

 private:
  template <class T>
  std::size_t add_plain_view(std::span<const T> values, json more) {
    const std::span<const std::byte> bytes = std::as_bytes(values);
    more["buffer"] = 0;
    more["byteOffset"] = append_aligned(parts_.binary, bytes, 8);
    more["byteLength"] = bytes.size();
    views_.push_back(std::move(more));
    return views_.size() - 1;
  }

  /// A view of values that are in the buffer in compressed form only.
  std::size_t add_compressed_view(std::span<const unsigned char> compressed, std::size_t count,
                                  std::size_t stride, json more, json extension) {
    decoded_bytes_ = (decoded_bytes_ + 3) / 4 * 4;
    more["buffer"] = 1;
    more["byteOffset"] = decoded_bytes_;
    more["byteLength"] = count * stride;
    decoded_bytes_ += count * stride;
    extension["buffer"] = 0;
    extension["byteOffset"] = append_aligned(parts_.binary, std::as_bytes(compressed), 4);
    extension["byteLength"] = compressed.size();
    extension["byteStride"] = stride;
    extension["count"] = count;
    more["extensions"]["EXT_meshopt_compression"] = std::move(extension);
    views_.push_back(std::move(more));
    return views_.size() - 1;
  }

  /// A view of something for each vertex; T is as long as the stride.
  template <class T>
  std::size_t add_vertex_view(std::span<const T> values, const char* filter = nullptr) {
    static_assert(sizeof(T) % 4 == 0);
    json more = {{"byteStride", sizeof(T)}, {"target", kArrayBuffer}};
    if (!compress_) return add_plain_view(values, std::move(more));
    std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(values.size(), sizeof(T)));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), values.data(),
                                            values.size(), sizeof(T)));
    json extension = {{"mode", "ATTRIBUTES"}};
    if (filter != nullptr) extension["filter"] = filter;
    return add_compressed_view(bytes, values.size(), sizeof(T), std::move(more),
                               std::move(extension));
  }

  std::size_t add_accessor(std::size_t view, int component, std::size_t count, const char* type,
                           json more = json::object()) {
    more["bufferView"] = view;
    more["componentType"] = component;
    more["count"] = count;
    more["type"] = type;
    accessors_.push_back(std::move(more));
    return accessors_.size() - 1;
  }

  std::size_t add_positions() {
    std::vector<std::array<float, 3>> values;
    std::array<float, 3> low = y_up(mesh_.positions[0]), high = low;
    for (const auto& position : mesh_.positions) {
      const auto& p = values.emplace_back(y_up(position));
      for (std::size_t i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], p[i]);
        high[i] = std::max(high[i], p[i]);
      }
    }
    return add_accessor(add_vertex_view(std::span<const std::array<float, 3>>(values)), kFloat,
                        values.size(), "VEC3", {{"min", low}, {"max", high}});
  }

  std::size_t add_normals() {
    std::vector<std::array<float, 3>> values;
    for (const auto& normal : mesh_.normals) values.push_back(y_up(normal));
    return add_accessor(add_vertex_view(std::span<const std::array<float, 3>>(values)), kFloat,
                        values.size(), "VEC3");
  }

  /// In 8 bits a coordinate: half a degree.
  std::size_t add_byte_normals() {
    std::vector<std::array<float, 4>> unit;
    for (const auto& normal : mesh_.normals) {
      const auto n = y_up(normal);
      unit.push_back({n[0], n[1], n[2], 0});
    }
    std::vector<std::array<std::int8_t, 4>> coded(unit.size());
    meshopt_encodeFilterOct(coded.data(), coded.size(), sizeof(coded[0]), 8, unit[0].data());
    return add_accessor(
        add_vertex_view(std::span<const std::array<std::int8_t, 4>>(coded), "OCTAHEDRAL"), kByte,
        coded.size(), "VEC3", {{"normalized", true}});
  }

  /// Floats, because glTF has no larger integers for vertices than 16 bits.
  void add_features(json& primitive) {
    std::vector<float> ids;
    for (const std::uint32_t row : mesh_.row_of_vertex) ids.push_back(static_cast<float>(row));
    primitive["attributes"]["_FEATURE_ID_0"] =
        add_accessor(add_vertex_view(std::span<const float>(ids)), kFloat, ids.size(), "SCALAR");
    const auto null = static_cast<std::uint32_t>(mesh_.groups.size());
    json feature = {{"featureCount", std::max<std::size_t>(1, mesh_.groups.size())},
                    {"nullFeatureId", null},
                    {"label", "group"},
                    {"attribute", 0}};
    if (!mesh_.groups.empty()) feature["propertyTable"] = 0;
    primitive["extensions"]["EXT_mesh_features"]["featureIds"] = json::array({feature});
    use("EXT_mesh_features");
  }

  std::size_t add_indices() {
    const bool is_short = mesh_.positions.size() <= kMostShortVertices;
    const std::size_t count = mesh_.corners.size();
    json more = {{"target", kElementArrayBuffer}};
    std::size_t view;
    if (compress_) {
      // Sequences of indices keep the order of triangles, which groups are ranges of.
      meshopt_encodeIndexVersion(1);
      std::vector<unsigned char> bytes(
          meshopt_encodeIndexBufferBound(count, mesh_.positions.size()));
      bytes.resize(
          meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), mesh_.corners.data(), count));
      view = add_compressed_view(bytes, count, is_short ? 2 : 4, std::move(more),
                                 {{"mode", "TRIANGLES"}});
    } else if (is_short) {
      const std::vector<std::uint16_t> corners(mesh_.corners.begin(), mesh_.corners.end());
      view = add_plain_view(std::span<const std::uint16_t>(corners), std::move(more));
    } else {
      view = add_plain_view(std::span<const std::uint32_t>(mesh_.corners), std::move(more));
    }
    return add_accessor(view, is_short ? kUnsignedShort : kUnsignedInt, count, "SCALAR");
  }

  template <class T, class Get>
  void add_property(json& table, const char* name, Get get) {
    std::vector<T> values;
    for (const GroupRow& row : mesh_.groups) values.push_back(get(row));
    table["properties"][name]["values"] =
        add_plain_view(std::span<const T>(values), json::object());
  }

  void add_property_table() {
    json table = {{"class", "group"}, {"count", mesh_.groups.size()}};
    add_property<std::uint32_t>(table, "group", [](const GroupRow& r) { return r.group; });
    add_property<std::uint32_t>(table, "triangles", [](const GroupRow& r) { return r.triangles; });
    add_property<std::uint32_t>(table, "firstTriangle",
                                [](const GroupRow& r) { return r.first_triangle; });
    add_property<double>(table, "minimumHeight",
                         [](const GroupRow& r) { return r.least_height_m; });
    add_property<double>(table, "maximumHeight",
                         [](const GroupRow& r) { return r.greatest_height_m; });
    add_property<std::array<double, 4>>(table, "region",
                                        [](const GroupRow& r) { return r.region_rad; });
    json& extension = parts_.json["extensions"]["EXT_structural_metadata"];
    extension["schema"] = {{"id", "scarp_groups"}, {"classes", {{"group", group_class()}}}};
    extension["propertyTables"] = json::array({table});
    use("EXT_structural_metadata");
  }

  void use(const char* extension) { parts_.json["extensionsUsed"].push_back(extension); }

  const TerrainMesh& mesh_;
  bool compress_;
  GlbParts parts_;
  json accessors_ = json::array(), views_ = json::array();
  std::size_t decoded_bytes_ = 0;
};

}  // namespace

std::vector<std::byte> terrain_glb(const TerrainMesh& mesh, GlbCompression compression) {
  return TerrainGlb(mesh, compression).bytes();
}

}  // namespace scarp
