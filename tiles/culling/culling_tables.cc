#include "tiles/culling/culling_tables.h"

#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <cassert>
#include <cmath>
#include <vector>

#include "tiles/layers/gdal_session.h"
#include "tiles/runtime/scarp_runtime.h"
#include "tiles/store/part_file.h"

namespace scarp {
namespace {

using runtime::detail::read;

/// The file's sections again, for what the run time keeps to itself.
class Sections {
 public:
  explicit Sections(std::span<const std::byte> file)
      : bytes_(reinterpret_cast<const unsigned char*>(file.data())) {}

  double metres(std::int32_t units) const { return units * unit_m(); }
  double unit_m() const { return std::ldexp(1, -read<std::int32_t>(bytes_, 40)); }
  template <class T>
  T at(std::size_t offset) const {
    return read<T>(bytes_, offset);
  }
  const unsigned char* bytes() const { return bytes_; }

 private:
  const unsigned char* bytes_;
};

class Table {
 public:
  Table(GDALDataset& dataset, const char* name, const GdalSession& session, const std::string& path)
      : layer_(dataset.CreateLayer(name, nullptr, wkbNone, nullptr)),
        session_(session),
        path_(path) {
    if (layer_ == nullptr) session.fail(path);
  }

  void columns(OGRFieldType type, std::initializer_list<const char*> names) {
    for (const char* name : names) {
      OGRFieldDefn field(name, type);
      if (layer_->CreateField(&field) != OGRERR_NONE) session_.fail(path_);
    }
  }

  OGRFeatureUniquePtr row() const {
    return OGRFeatureUniquePtr(OGRFeature::CreateFeature(layer_->GetLayerDefn()));
  }
  void add(const OGRFeatureUniquePtr& row) {
    if (layer_->CreateFeature(row.get()) != OGRERR_NONE) session_.fail(path_);
  }

 private:
  OGRLayer* layer_;
  const GdalSession& session_;
  const std::string& path_;
};

void add_frame(Table table, const Sections& file, const std::string& crs_wkt) {
  table.columns(OFTString, {"earth", "crs_wkt"});
  table.columns(OFTReal,
                {"origin_x", "origin_y", "origin_z", "east_x", "east_y", "east_z", "north_x",
                 "north_y", "north_z", "up_x", "up_y", "up_z", "scale_m", "bend_m", "unit_m"});
  table.columns(OFTInteger, {"sectors", "ring_bits"});
  const auto row = table.row();
  row->SetField("earth", file.at<std::uint32_t>(44) == 0 ? "flat" : "ellipsoid");
  row->SetField("crs_wkt", crs_wkt.c_str());
  for (int i = 0; i < 14; ++i)
    row->SetField(2 + i, file.at<double>(48 + 8 * static_cast<std::size_t>(i)));
  row->SetField("unit_m", file.unit_m());
  row->SetField("sectors", file.at<std::int32_t>(32));
  row->SetField("ring_bits", file.at<std::int32_t>(36));
  table.add(row);
}

void add_tiles(Table table, const Sections& file, const runtime::Culling& culling) {
  table.columns(OFTInteger, {"level", "column", "row", "is_finest", "has_orphans"});
  table.columns(OFTInteger64, {"first_group", "groups"});
  table.columns(OFTReal, {"low_x_m", "low_y_m", "low_z_m", "high_x_m", "high_y_m", "high_z_m"});
  for (std::uint32_t i = 0; i < culling.tiles(); ++i) {
    const runtime::Tile& tile = culling.tile(i);
    const auto row = table.row();
    row->SetField(0, static_cast<int>(tile.level));
    row->SetField(1, static_cast<int>(tile.column));
    row->SetField(2, static_cast<int>(tile.row));
    row->SetField(3, (tile.flags & runtime::kIsFinest) != 0 ? 1 : 0);
    row->SetField(4, (tile.flags & runtime::kHasOrphans) != 0 ? 1 : 0);
    row->SetField(5, static_cast<GIntBig>(tile.first_group));
    row->SetField(6, static_cast<GIntBig>(tile.groups));
    for (int axis = 0; axis < 3; ++axis) {
      row->SetField(7 + axis, file.metres(tile.low[axis]));
      row->SetField(10 + axis, file.metres(tile.high[axis]));
    }
    table.add(row);
  }
}

void add_groups(Table table, const runtime::Culling& culling) {
  table.columns(OFTInteger64, {"place", "group", "triangles"});
  table.columns(OFTReal,
                {"centre_x_m", "centre_y_m", "height_m", "radius_m", "low_slope", "slope_step",
                 "low_x_m", "low_y_m", "low_z_m", "high_x_m", "high_y_m", "high_z_m"});
  table.columns(OFTBinary, {"steps"});
  const double unit_m = culling.unit_m();
  for (std::uint32_t g = 0; g < culling.groups(); ++g) {
    const runtime::GroupRecord record = culling.record(g);
    const auto row = table.row();
    row->SetField(0, static_cast<GIntBig>(g));
    row->SetField(1, static_cast<GIntBig>(culling.id(g)));
    row->SetField(2, static_cast<GIntBig>(culling.triangles(g)));
    row->SetField(3, record.x * unit_m);
    row->SetField(4, record.y * unit_m);
    row->SetField(5, record.height * unit_m);
    row->SetField(6, 65536 / static_cast<double>(record.inverse_radius) * unit_m);
    row->SetField(7, record.low_slope * 0x1p-20);
    row->SetField(8, record.slope_step * 0x1p-30);
    for (int i = 0; i < 6; ++i) row->SetField(9 + i, record.box[i] * unit_m);
    row->SetField(15, static_cast<int>(record.sectors * runtime::detail::kSteps * 2), record.steps);
    table.add(row);
  }
}

void add_heights(Table table, const Sections& file, std::size_t bytes) {
  table.columns(OFTInteger, {"columns", "rows"});
  table.columns(OFTReal, {"cell_m", "low_x_m", "low_y_m", "base_m", "step_m"});
  table.columns(OFTBinary, {"codes"});
  const auto columns = file.at<std::int32_t>(168), rows = file.at<std::int32_t>(172);
  const double cell_m = std::ldexp(file.unit_m(), file.at<std::int32_t>(176));
  const auto row = table.row();
  row->SetField(0, columns);
  row->SetField(1, rows);
  row->SetField(2, cell_m);
  row->SetField(3, file.at<std::int32_t>(160) * cell_m);
  row->SetField(4, file.at<std::int32_t>(164) * cell_m);
  row->SetField(5, file.metres(file.at<std::int32_t>(180)));
  row->SetField(6, std::ldexp(file.unit_m(), file.at<std::int32_t>(184)));
  // The first level of the pyramid, which begins where the last section does.
  std::size_t cells = 0;
  for (std::size_t c = static_cast<std::size_t>(columns), r = static_cast<std::size_t>(rows); c > 0;
       c = (c + 1) / 2, r = (r + 1) / 2) {
    cells += c * r;
    if (c == 1 && r == 1) break;
  }
  row->SetField(7, columns * rows * 2, file.bytes() + (bytes - cells * 2));
  table.add(row);
}

}  // namespace

void write_culling_tables(const std::string& path, std::span<const std::byte> culling_file,
                          const std::string& crs_wkt) {
  runtime::Culling culling;
  [[maybe_unused]] const runtime::Status status =
      culling.open(culling_file.data(), culling_file.size(), runtime::Check::kStructure);
  assert(status == runtime::Status::kOk);
  PartFile part(path, Existing::kRefuse);
  const GdalSession session;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GPKG");
  if (driver == nullptr) session.fail(path);
  const std::string built = session.folder() + "/built.gpkg";
  GDALDatasetUniquePtr dataset(driver->Create(built.c_str(), 0, 0, 0, GDT_Unknown, nullptr));
  if (!dataset || dataset->StartTransaction() != OGRERR_NONE) session.fail(path);
  const Sections file(culling_file);
  add_frame(Table(*dataset, "frame", session, path), file, crs_wkt);
  add_tiles(Table(*dataset, "tiles", session, path), file, culling);
  add_groups(Table(*dataset, "groups", session, path), culling);
  add_heights(Table(*dataset, "heights", session, path), file, culling_file.size());
  if (dataset->CommitTransaction() != OGRERR_NONE) session.fail(path);
  dataset.reset();  // closing writes the rest
  session.check(path);
  part.append(session.bytes_of(built, path));
  part.commit();
}

}  // namespace scarp
