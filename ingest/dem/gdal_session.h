#pragma once

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <memory>
#include <string>

namespace scarp {

struct CloseDataset {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};
using DatasetPtr = std::unique_ptr<GDALDataset, CloseDataset>;

struct DestroyTransformation {
  void operator()(OGRCoordinateTransformation* t) const {
    OGRCoordinateTransformation::DestroyCT(t);
  }
};
using TransformationPtr = std::unique_ptr<OGRCoordinateTransformation, DestroyTransformation>;

/// Opens a file for reading, drivers registered and side files off.
/// Throws Error{kInput} that names the file and GDAL's own reason.
/// @param what  what was wanted, for the message, such as "a raster that GDAL reads"
DatasetPtr open_dataset(const std::string& file, unsigned int open_flags, const std::string& what);

}  // namespace scarp
