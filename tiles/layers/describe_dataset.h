#pragma once

#include <string>

#include "tiles/layers/geotiff.h"

class GDALDataset;

namespace scarp {

/// Gives a dataset all of a layer but its samples: place, CRS, metadata, what its bands are called
/// and mean. Errors: kInput where the CRS is not WKT.
void describe(GDALDataset& dataset, const RasterLayer& layer, const std::string& path);

}  // namespace scarp
