#include "tiles/layers/geopackage.h"

#include <cpl_string.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <array>
#include <cassert>
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

void fill_layer(GDALDataset& dataset, std::span<const GroupPolygon> groups,
                OGRSpatialReference* crs, const GdalSession& session, const std::string& path) {
  if (dataset.StartTransaction() != OGRERR_NONE) session.fail(path);
  OGRLayer* layer = dataset.CreateLayer("groups", crs, wkbMultiPolygon, nullptr);
  if (layer == nullptr) session.fail(path);
  for (const Field& field : kFields) {
    OGRFieldDefn definition(field.name, field.type);
    if (layer->CreateField(&definition) != OGRERR_NONE) session.fail(path);
  }
  for (const GroupPolygon& group : groups) {
    if (layer->CreateFeature(feature_of(group, *layer).get()) != OGRERR_NONE) session.fail(path);
  }
  if (dataset.CommitTransaction() != OGRERR_NONE) session.fail(path);
}

}  // namespace

void write_group_polygons(const std::string& path, std::span<const GroupPolygon> groups,
                          const std::string& crs_wkt, Existing existing) {
  PartFile file(path, existing);
  const GdalSession session;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GPKG");
  if (driver == nullptr) session.fail(path);
  const std::string built = session.folder() + "/groups.gpkg";
  GDALDatasetUniquePtr dataset(driver->Create(built.c_str(), 0, 0, 0, GDT_Unknown, nullptr));
  if (!dataset) session.fail(path);
  if (crs_wkt.empty()) {
    fill_layer(*dataset, groups, nullptr, session, path);
  } else {
    OGRSpatialReference crs = spatial_reference(crs_wkt, path);
    fill_layer(*dataset, groups, &crs, session, path);
  }
  dataset.reset();  // closing writes the rest
  session.check(path);
  file.append(session.bytes_of(built, path));
  file.commit();
}

}  // namespace scarp
