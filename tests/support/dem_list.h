#pragma once

#include <array>
#include <optional>

namespace scarp::test {

/// A DEM of the shared data collection and what must be said to read it.
struct ListedDem {
  const char* name;
  const char* file;
  bool flat = false;                  ///< no CRS, or one that is nowhere on the Earth
  std::optional<double> nodata = {};  ///< where the file does not declare it
};

/// The DEMs that figures over all DEMs are about: every raster of ground in the collection but for
/// scale/ (too large for a comparison) and copies of the same ground.
inline constexpr std::array<ListedDem, 26> kListedDems = {{
    {"big-tujunga", "projected/bigtujunga_srtm30m_utm11.tif"},
    {"mt-st-helens", "projected/mt_st_helens_usgs30m.dem"},
    {"mandakini", "projected/mandakini_srtm90_utm44.bil"},
    {"meghalaya", "projected/meghalaya_50m_utm46.bil"},
    {"gabilan", "projected/gabilan_lidar1m.bil"},
    {"slovenia", "projected/slovenia_lidar1m_nan_nodata.tif"},
    {"vinschgau", "projected/vinschgau_alps_250m_utm32.tif"},
    {"new-zealand", "projected/new_zealand_1km_nztm.tif"},
    {"swiss-alps", "geographic/N46E008_swiss_alps_srtm3.tif"},
    {"vancouver", "geographic/N49W123_vancouver_srtm3.tif"},
    {"aconcagua", "geographic/S33W071_aconcagua.dt1"},
    {"everest", "geographic/N27E086_everest_srtm3_voids.tif"},
    {"fuji", "geographic/N35E138_fuji_srtm3.tif"},
    {"andorra", "geographic/N42E001.hgt"},
    {"crater-lake-30m", "geographic/crater_lake_30m_wgs84.tif", false, -32767},
    {"jacksboro", "geographic/jacksboro_fault_srtm3.tif"},
    {"zion", "geographic/zion_srtm3_uint16.tif"},
    {"front-range", "geographic/front_range_srtmgl3.asc", true},
    {"ashby-gap", "literature/ashby_gap_va_i16.tif", true},
    {"crater-lake-west", "literature/crater_lake_west_i16.tif", true},
    {"fort-irwin", "literature/ntc_fort_irwin_i16.tif", true},
    {"west-us", "literature/west_us_i16.tif", true},
    {"lake-district", "reference/lakedistrict_dem_50m.tif"},
    {"lakes", "reference/lakes_dem_50m_utm11.tif"},
    {"czech-village", "urban/czech_village_dsm1m_krovak.tif"},
    {"manhattan", "urban/manhattan_lower_dsm_1m_utm18n.tif"},
}};

}  // namespace scarp::test
