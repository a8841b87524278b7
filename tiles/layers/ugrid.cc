#include "tiles/layers/ugrid.h"

#include <fmt/format.h>
#include <netcdf.h>

#include <cassert>
#include <optional>

#include "core/error/error.h"
#include "tiles/layers/spatial_reference.h"

namespace scarp {
namespace {

constexpr int kNoVertex = -1;

/// A netCDF file that is being written; every call of the library goes through try_to.
class NetcdfFile {
 public:
  NetcdfFile(const std::string& part_path, std::string path) : path_(std::move(path)) {
    try_to(nc_create(part_path.c_str(), NC_CLOBBER | NC_64BIT_OFFSET, &file_));
    is_open_ = true;
    // Every value is written once: no need to fill files first.
    int old_mode = 0;
    try_to(nc_set_fill(file_, NC_NOFILL, &old_mode));
  }
  ~NetcdfFile() {
    if (is_open_) nc_abort(file_);
  }
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  void close() {
    is_open_ = false;
    try_to(nc_close(file_));
  }

  int dimension(const char* name, std::size_t size) {
    int id = 0;
    try_to(nc_def_dim(file_, name, size, &id));
    return id;
  }

  int variable(const std::string& name, nc_type type, std::vector<int> dimensions) {
    int id = 0;
    try_to(nc_def_var(file_, name.c_str(), type, static_cast<int>(dimensions.size()),
                      dimensions.data(), &id));
    return id;
  }

  void text(int variable, const char* name, const std::string& value) {
    try_to(nc_put_att_text(file_, variable, name, value.size(), value.data()));
  }
  void number(int variable, const char* name, int value) {
    try_to(nc_put_att_int(file_, variable, name, NC_INT, 1, &value));
  }
  void number(int variable, const char* name, double value) {
    try_to(nc_put_att_double(file_, variable, name, NC_DOUBLE, 1, &value));
  }

  void end_definitions() { try_to(nc_enddef(file_)); }
  void put(int variable, const double* values) {
    try_to(nc_put_var_double(file_, variable, values));
  }
  void put(int variable, const int* values) { try_to(nc_put_var_int(file_, variable, values)); }

 private:
  void try_to(int status) const {
    if (status == NC_NOERR) return;
    throw Error(ErrorCode::kResource, fmt::format("'{}': cannot be written ({}); room on the disk "
                                                  "was expected; free some or choose another place",
                                                  path_, nc_strerror(status)));
  }

  std::string path_;
  int file_ = -1;
  bool is_open_ = false;
};

struct Dimensions {
  int vertices, triangles, corners;
};

/// What a variable over vertices or triangles is, for readers.
void describe(NetcdfFile& file, int variable, const char* location, const std::string& name,
              const std::string& unit, const char* crs_name) {
  file.text(variable, "long_name", name);
  file.text(variable, "units", unit);
  file.text(variable, "mesh", "mesh2d");
  file.text(variable, "location", location);
  if (crs_name != nullptr) file.text(variable, "grid_mapping", crs_name);
}

void define_topology(NetcdfFile& file) {
  const int mesh = file.variable("mesh2d", NC_INT, {});
  file.text(mesh, "cf_role", "mesh_topology");
  file.text(mesh, "long_name", "Triangulated irregular network of the ground");
  file.number(mesh, "topology_dimension", 2);
  file.text(mesh, "node_dimension", "mesh2d_nNodes");
  file.text(mesh, "node_coordinates", "mesh2d_node_x mesh2d_node_y");
  file.text(mesh, "face_dimension", "mesh2d_nFaces");
  file.text(mesh, "max_face_nodes_dimension", "mesh2d_nMax_face_nodes");
  file.text(mesh, "face_node_connectivity", "mesh2d_face_nodes");
}

/// The variable that carries the CRS, by the names that readers look for. Null without a CRS.
const char* define_crs(NetcdfFile& file, const std::string& wkt, const std::string& path,
                       bool& is_geographic) {
  is_geographic = false;
  if (wkt.empty()) return nullptr;
  const OGRSpatialReference crs = spatial_reference(wkt, path);
  is_geographic = crs.IsGeographic() != 0;
  const char* name = is_geographic ? "wgs84" : "projected_coordinate_system";
  const int variable = file.variable(name, NC_INT, {});
  file.text(variable, "wkt", wkt);
  file.text(variable, "crs_wkt", wkt);
  const char* authority = crs.GetAuthorityName(nullptr);
  const char* code = crs.GetAuthorityCode(nullptr);
  if (authority != nullptr && code != nullptr && std::string(authority) == "EPSG") {
    file.number(variable, "epsg", std::atoi(code));
    file.text(variable, "EPSG_code", std::string("EPSG:") + code);
  }
  return name;
}

}  // namespace

void write_ugrid(const std::string& path, const MapMesh& mesh, Existing existing) {
  assert(mesh.heights_m.size() == mesh.places.size());
  assert(mesh.group_of_triangle.size() == mesh.triangles.size());
  assert(mesh.places.size() < (std::size_t{1} << 31) && !mesh.triangles.empty());
  PartFile part(path, existing);
  NetcdfFile file(part.part_path(), path);
  file.text(NC_GLOBAL, "Conventions", "CF-1.8 UGRID-1.0");
  file.text(NC_GLOBAL, "source", "scarp " SCARP_VERSION);
  const Dimensions size = {file.dimension("mesh2d_nNodes", mesh.places.size()),
                           file.dimension("mesh2d_nFaces", mesh.triangles.size()),
                           file.dimension("mesh2d_nMax_face_nodes", 3)};
  define_topology(file);
  bool is_geographic = false;
  const char* crs = define_crs(file, mesh.crs_wkt, path, is_geographic);
  const int x = file.variable("mesh2d_node_x", NC_DOUBLE, {size.vertices});
  describe(file, x, "node", "x of vertices", is_geographic ? "degrees_east" : "m", crs);
  file.text(x, "standard_name", is_geographic ? "longitude" : "projection_x_coordinate");
  const int y = file.variable("mesh2d_node_y", NC_DOUBLE, {size.vertices});
  describe(file, y, "node", "y of vertices", is_geographic ? "degrees_north" : "m", crs);
  file.text(y, "standard_name", is_geographic ? "latitude" : "projection_y_coordinate");
  const int z = file.variable("mesh2d_node_z", NC_DOUBLE, {size.vertices});
  describe(file, z, "node", "height of vertices", "m", crs);
  file.text(z, "standard_name", "altitude");
  file.text(z, "positive", "up");
  file.text(z, "coordinates", "mesh2d_node_x mesh2d_node_y");
  const int corners = file.variable("mesh2d_face_nodes", NC_INT, {size.triangles, size.corners});
  file.text(corners, "cf_role", "face_node_connectivity");
  file.text(corners, "long_name", "vertices of triangles, counter-clockwise");
  file.number(corners, "start_index", 0);
  file.number(corners, "_FillValue", kNoVertex);
  const int group = file.variable("group", NC_INT, {size.triangles});
  describe(file, group, "face", "number of the group in the scene", "1", crs);
  file.number(group, "_FillValue", -1);
  std::vector<int> values;
  for (const FaceValues& face : mesh.values) {
    assert(face.values.size() == mesh.triangles.size());
    values.push_back(file.variable(face.name, NC_DOUBLE, {size.triangles}));
    describe(file, values.back(), "face", face.description, face.unit, crs);
    file.number(values.back(), "_FillValue", std::numeric_limits<double>::quiet_NaN());
  }
  file.end_definitions();

  std::vector<double> row(mesh.places.size());
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = mesh.places[i].x;
  file.put(x, row.data());
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = mesh.places[i].y;
  file.put(y, row.data());
  file.put(z, mesh.heights_m.data());
  static_assert(sizeof(mesh.triangles[0]) == 3 * sizeof(int));
  file.put(corners, reinterpret_cast<const int*>(mesh.triangles.data()));
  file.put(group, mesh.group_of_triangle.data());
  for (std::size_t i = 0; i < values.size(); ++i) file.put(values[i], mesh.values[i].values.data());
  file.close();
  part.take_over();
  part.commit();
}

}  // namespace scarp
