#include "tests/support/refined_dem.h"

#include <cstdlib>

namespace scarp::test {

std::string refined_dem(const std::string& dem, int side, const TempFolder& folder) {
  const std::string plain = folder.path("plain.tif");
  const std::string path = folder.path("u" + std::to_string(side) + ".tif");
  const std::string size = std::to_string(side) + " " + std::to_string(side);
  const std::string commands =
      "gdal_translate -q -a_nodata none -ot Float32 '" + dem + "' '" + plain +
      "' && gdalwarp -q -overwrite -te 384653.655454263 3788687.828 403853.655454263 3807887.828 "
      "-ts " +
      size + " -r cubic -ot Float32 '" + plain + "' '" + path + "'";
  if (std::system(commands.c_str()) != 0) std::exit(1);
  return path;
}

}  // namespace scarp::test
