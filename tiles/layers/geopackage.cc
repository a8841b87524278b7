#include "tiles/layers/geopackage.h"

#include <cpl_string.h>
#include <gdal_alg.h>
#include <gdal_priv.h>
#include <gdal_utils.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <filesystem>
#include <memory>

#include "tiles/layers/gdal_session.h"
#include "tiles/layers/spatial_reference.h"

namespace scarp {
namespace {

struct Field {
  const char* name;
  OGRFieldType type;
};
constexpr std::array<Field, 6> kFields = {{{"group", OFTInteger64},
                                           {"parent", OFTInteger64},
                                           {"triangles", OFTInteger64},
                                           {"area_m2", OFTReal},
                                           {"height_min_m", OFTReal},
                                           {"height_max_m", OFTReal}}};

std::unique_ptr<OGRMultiPolygon> geometry_of(const GroupPolygon& group) {
  auto geometry = std::make_unique<OGRMultiPolygon>();
  for (const std::vector<Ring>& rings : group.polygons) {
    auto polygon = std::make_unique<OGRPolygon>();
    for (const Ring& ring : rings) {
      assert(ring.size() >= 3);
      auto line = std::make_unique<OGRLinearRing>();
      line->setNumPoints(static_cast<int>(ring.size()) + 1);
      for (std::size_t i = 0; i <= ring.size(); ++i) {
        const RingPoint& point = ring[i < ring.size() ? i : 0];
        line->setPoint(static_cast<int>(i), point.x, point.y);
      }
      polygon->addRingDirectly(line.release());
    }
    geometry->addGeometryDirectly(polygon.release());
  }
  return geometry;
}

OGRFeatureUniquePtr feature_of(const GroupPolygon& group, OGRLayer& layer) {
  OGRFeatureUniquePtr feature(OGRFeature::CreateFeature(layer.GetLayerDefn()));
  feature->SetField(0, static_cast<GIntBig>(group.group));
  if (group.parent < 0)
    feature->SetFieldNull(1);
  else
    feature->SetField(1, static_cast<GIntBig>(group.parent));
  feature->SetField(2, static_cast<GIntBig>(group.triangles));
  feature->SetField(3, group.area_m2);
  feature->SetField(4, group.height_min_m);
  feature->SetField(5, group.height_max_m);
  feature->SetGeometryDirectly(geometry_of(group).release());
  return feature;
}

void fill_layer(GDALDataset& dataset, const std::function<void(const TakeGroups&)>& give,
                OGRSpatialReference* crs, const GdalSession& session, const std::string& path) {
  if (dataset.StartTransaction() != OGRERR_NONE) session.fail(path);
  OGRLayer* layer = dataset.CreateLayer("groups", crs, wkbMultiPolygon, nullptr);
  if (layer == nullptr) session.fail(path);
  for (const Field& field : kFields) {
    OGRFieldDefn definition(field.name, field.type);
    if (layer->CreateField(&definition) != OGRERR_NONE) session.fail(path);
  }
  give([&](std::span<const GroupPolygon> groups) {
    for (const GroupPolygon& group : groups)
      if (layer->CreateFeature(feature_of(group, *layer).get()) != OGRERR_NONE) session.fail(path);
  });
  if (dataset.CommitTransaction() != OGRERR_NONE) session.fail(path);
}

/// A raster in memory of two bands: values, and a mask of those that are to be outlined.
GDALDatasetUniquePtr raster_in_memory(const RasterLayer& raster, const GdalSession& session,
                                      const std::string& path) {
  const auto count =
      static_cast<std::size_t>(raster.columns) * static_cast<std::size_t>(raster.rows);
  std::vector<std::int32_t> values(count);
  std::vector<std::uint8_t> mask(count);
  std::visit(
      [&](const auto& samples) {
        assert(samples.size() == count);
        for (std::size_t i = 0; i < count; ++i) {
          const auto value = static_cast<double>(samples[i]);
          mask[i] = value != 0 && value != raster.nodata ? 1 : 0;
          values[i] = mask[i] ? static_cast<std::int32_t>(value) : 0;
        }
      },
      raster.samples);
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("MEM");
  if (driver == nullptr) session.fail(path);
  GDALDatasetUniquePtr dataset(
      driver->Create("", raster.columns, raster.rows, 0, GDT_Int32, nullptr));
  if (!dataset) session.fail(path);
  std::array<double, 6> transform = raster.geotransform;
  dataset->SetGeoTransform(transform.data());
  const auto add = [&](GDALDataType type, void* data) {
    if (dataset->AddBand(type, nullptr) != CE_None ||
        dataset->GetRasterBand(dataset->GetRasterCount())
                ->RasterIO(GF_Write, 0, 0, raster.columns, raster.rows, data, raster.columns,
                           raster.rows, type, 0, 0, nullptr) != CE_None)
      session.fail(path);
  };
  add(GDT_Int32, values.data());
  add(GDT_Byte, mask.data());
  return dataset;
}

void outline_areas(GDALDataset& dataset, const RasterLayer& raster, const std::string& field,
                   OGRSpatialReference* crs, const GdalSession& session, const std::string& path) {
  const GDALDatasetUniquePtr values = raster_in_memory(raster, session, path);
  const bool in_one_go = dataset.TestCapability(ODsCTransactions);
  if (in_one_go && dataset.StartTransaction() != OGRERR_NONE) session.fail(path);
  OGRLayer* layer = dataset.CreateLayer("areas", crs, wkbPolygon, nullptr);
  if (layer == nullptr) session.fail(path);
  OGRFieldDefn definition(field.c_str(), OFTInteger64);
  if (layer->CreateField(&definition) != OGRERR_NONE ||
      GDALPolygonize(values->GetRasterBand(1), values->GetRasterBand(2), OGRLayer::ToHandle(layer),
                     0, nullptr, nullptr, nullptr) != CE_None ||
      (in_one_go && dataset.CommitTransaction() != OGRERR_NONE))
    session.fail(path);
}

/// Makes a GeoPackage where GDAL can write it. @param fill  (dataset, crs, session)
template <typename Fill>
void build_geopackage(const std::string& built, const std::string& path, const std::string& crs_wkt,
                      const GdalSession& session, const Fill& fill) {
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GPKG");
  if (driver == nullptr) session.fail(path);
  GDALDatasetUniquePtr dataset(driver->Create(built.c_str(), 0, 0, 0, GDT_Unknown, nullptr));
  if (!dataset) session.fail(path);
  if (crs_wkt.empty()) {
    fill(*dataset, nullptr, session);
  } else {
    OGRSpatialReference crs = spatial_reference(crs_wkt, path);
    fill(*dataset, &crs, session);
  }
  dataset.reset();  // closing writes the rest
  session.check(path);
}

/// Builds a GeoPackage in memory and puts it in its place.
template <typename Fill>
void write_geopackage(const std::string& path, const std::string& crs_wkt, Existing existing,
                      const Fill& fill) {
  PartFile file(path, existing);
  const GdalSession session;
  const std::string built = session.folder() + "/built.gpkg";
  build_geopackage(built, path, crs_wkt, session, fill);
  file.append(session.bytes_of(built, path));
  file.commit();
}

/// A file that is not there before and after, nor what SQLite may leave beside it.
class BuiltFile {
 public:
  explicit BuiltFile(std::string path) : path_(std::move(path)) { remove(); }
  ~BuiltFile() { remove(); }
  BuiltFile(const BuiltFile&) = delete;
  BuiltFile& operator=(const BuiltFile&) = delete;

 private:
  void remove() const {
    std::error_code ignored;
    for (const char* ending : {"", "-journal"}) std::filesystem::remove(path_ + ending, ignored);
  }

  std::string path_;
};

/// GDAL does not say what fails while it closes a file: whether all is there, the spatial index
/// too.
void check_whole(const std::string& built, std::uint64_t groups, const GdalSession& session,
                 const std::string& path) {
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(built.c_str(), GDAL_OF_VECTOR));
  if (!dataset) session.fail(path);
  for (const char* count :
       {"SELECT COUNT(*) FROM groups", "SELECT COUNT(*) FROM rtree_groups_geom"}) {
    OGRLayer* answer = dataset->ExecuteSQL(count, nullptr, nullptr);
    if (answer == nullptr) session.fail(path);
    const OGRFeatureUniquePtr row(answer->GetNextFeature());
    const bool is_whole = row && row->GetFieldAsInteger64(0) == static_cast<GIntBig>(groups);
    dataset->ReleaseResultSet(answer);
    if (!is_whole) session.fail(path);
  }
}

}  // namespace

void write_group_polygons(const std::string& path, std::span<const GroupPolygon> groups,
                          const std::string& crs_wkt, Existing existing) {
  write_geopackage(path, crs_wkt, existing,
                   [&](GDALDataset& dataset, OGRSpatialReference* crs, const GdalSession& session) {
                     fill_layer(
                         dataset, [&](const TakeGroups& take) { take(groups); }, crs, session,
                         path);
                   });
}

void write_group_polygons_in_pieces(const std::string& path, const std::string& work_path,
                                    const std::function<void(const TakeGroups&)>& give,
                                    const std::string& crs_wkt, Existing existing) {
  PartFile file(path, existing);
  const GdalSession session;
  const BuiltFile built(work_path);
  std::uint64_t groups = 0;
  build_geopackage(
      work_path, path, crs_wkt, session,
      [&](GDALDataset& dataset, OGRSpatialReference* crs, const GdalSession& of_dataset) {
        const auto give_counted = [&](const TakeGroups& take) {
          give([&](std::span<const GroupPolygon> piece) {
            take(piece);
            groups += piece.size();
          });
        };
        fill_layer(dataset, give_counted, crs, of_dataset, path);
      });
  check_whole(work_path, groups, session, path);
  std::error_code failure;
  std::filesystem::rename(work_path, file.part_path(), failure);
  if (failure) session.fail(path);
  file.take_over();
  file.commit();
}

void write_area_polygons(const std::string& path, const RasterLayer& layer,
                         const std::string& field, Existing existing) {
  assert(!std::holds_alternative<std::span<const float>>(layer.samples));
  write_geopackage(path, layer.crs_wkt, existing,
                   [&](GDALDataset& dataset, OGRSpatialReference* crs, const GdalSession& session) {
                     outline_areas(dataset, layer, field, crs, session, path);
                   });
}

std::string area_polygons_geojson(const RasterLayer& layer, const std::string& field) {
  assert(!std::holds_alternative<std::span<const float>>(layer.samples));
  assert(!layer.crs_wkt.empty());
  const std::string name = "areas.geojson";
  const GdalSession session;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("Memory");
  if (driver == nullptr) session.fail(name);
  GDALDatasetUniquePtr outlined(driver->Create("", 0, 0, 0, GDT_Unknown, nullptr));
  if (!outlined) session.fail(name);
  OGRSpatialReference crs = spatial_reference(layer.crs_wkt, name);
  outline_areas(*outlined, layer, field, &crs, session, name);
  CPLStringList arguments;
  for (const char* argument : {"-f", "GeoJSON", "-lco", "RFC7946=YES", "-lco",
                               "COORDINATE_PRECISION=7", "-lco", "WRITE_NAME=NO"})
    arguments.AddString(argument);
  const std::unique_ptr<GDALVectorTranslateOptions, decltype(&GDALVectorTranslateOptionsFree)>
      options(GDALVectorTranslateOptionsNew(arguments.List(), nullptr),
              &GDALVectorTranslateOptionsFree);
  const std::string built = session.folder() + "/" + name;
  GDALDatasetH source = GDALDataset::ToHandle(outlined.get());
  int misuse = 0;
  GDALDatasetH written =
      GDALVectorTranslate(built.c_str(), nullptr, 1, &source, options.get(), &misuse);
  if (written == nullptr) session.fail(name);
  GDALClose(written);  // closing writes the rest
  session.check(name);
  const std::span<const std::byte> bytes = session.bytes_of(built, name);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace scarp
