#pragma once

#include <string>

#include "tests/support/temp_folder.h"

namespace scarp::test {

/// Big Tujunga, cut to 19.2 km and refined by cubic resampling to side x side samples, as a GeoTIFF
/// in the folder: the same ground in any number of samples. Ends the program where GDAL fails.
/// @param dem  projected/bigtujunga_srtm30m_utm11.tif of the shared data
std::string refined_dem(const std::string& dem, int side, const TempFolder& folder);

}  // namespace scarp::test
